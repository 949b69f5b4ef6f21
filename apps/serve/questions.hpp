#pragma once

#include "serve/http_message.hpp"

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf {

/// A parameter of a question.
struct QuestionParameter {
  enum class Kind { number, whole, text, numbers };
  std::string name;
  Kind kind = Kind::number;
  std::string description;   ///< with its unit
  double low = 0, high = 0;  ///< limits of every number
  std::size_t count = 1;     ///< of `numbers`
  bool required = false;
  nlohmann::json otherwise{};        ///< default; null: none
  std::vector<std::string> words{};  ///< of `text`: what it may be; empty: anything short
};

/// A question that can be asked by GET (parameters in the query, numbers with commas) or POST (a JSON
/// object).
struct Question {
  std::string path, summary;
  std::vector<QuestionParameter> parameters;
  std::string_view answer;  ///< JSON schema of the answer's properties
};

const std::vector<Question>& questions();

/// /live, which is no question, but takes parameters as one: what it is told, is told over a WebSocket.
const Question& live_question();

/// The question that is asked at `path`; null if there is none.
const Question* find_question(std::string_view path);

/// The parameters that a request gives, checked: each of its kind and within its limits, no other ones.
class Values {
 public:
  /// Throws Error(usage) naming the parameter.
  Values(const Question& question, const HttpRequest& request);

  bool has(const std::string& name) const { return json_.contains(name); }
  double number(const std::string& name) const { return json_.at(name).get<double>(); }
  std::string text(const std::string& name) const { return json_.at(name).get<std::string>(); }
  std::vector<double> numbers(const std::string& name) const {
    return json_.at(name).get<std::vector<double>>();
  }
  const nlohmann::json& json() const { return json_; }

 private:
  nlohmann::json json_;  ///< an object; defaults are filled in
};

/// The name of the parameter that `option` ("--max-slope 3") is called in this question ("max_slope_deg");
/// `option` if it is none.
std::string parameter_of(const Question& question, const std::string& option);

/// OpenAPI 3 document of everything that is served.
std::string openapi_json();

}  // namespace octosurf
