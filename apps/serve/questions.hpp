#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf {

/// A parameter of a question, in the query of its URL.
struct QuestionParameter {
  enum class Kind { number, whole, text };
  std::string name;
  Kind kind = Kind::number;
  std::string description;   ///< with its unit
  double low = 0, high = 0;  ///< limits of every number
  std::size_t count = 1;     ///< of numbers, with commas
  bool required = false;
  std::string otherwise{};           ///< default, as it would be given; empty: none
  std::vector<std::string> words{};  ///< of `text`: what it may be; empty: anything short
};

struct Question {
  std::string path, summary;
  std::vector<QuestionParameter> parameters;
};

const std::vector<Question>& questions();

/// The question that is asked at `path`; null if there is none.
const Question* find_question(std::string_view path);

/// The question whose answer is a stream of events: HttpServer.
constexpr const char* live_path = "/live";

/// All of them, as JSON.
std::string questions_json();

/// What stands in the query of a request's URL, decoded.
using QueryParameters = std::multimap<std::string, std::string>;

/// The parameters that a request gives, checked: each of its kind and within its limits, no other ones.
class Values {
 public:
  /// Throws Error(usage) naming the parameter.
  Values(const Question& question, const QueryParameters& given);

  bool has(const std::string& name) const { return numbers_.contains(name) || texts_.contains(name); }
  double number(const std::string& name) const { return numbers_.at(name)[0]; }
  const std::vector<double>& numbers(const std::string& name) const { return numbers_.at(name); }
  std::string text(const std::string& name) const { return texts_.at(name); }

 private:
  void take(const QuestionParameter& parameter, const std::string& text);

  std::map<std::string, std::vector<double>> numbers_;  ///< with the defaults
  std::map<std::string, std::string> texts_;            ///< likewise
};

/// The name of the parameter that `option` ("--max-slope 3") is called in this question ("max_slope_deg");
/// `option` if it is none.
std::string parameter_of(const Question& question, const std::string& option);

}  // namespace octosurf
