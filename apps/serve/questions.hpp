#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf {

/// All questions, as GET /api lists them: [{"path", "summary", "parameters": {NAME: {"description", …}}}]. A
/// parameter is a text, with the "words" that it may be (none: anything short), or has as many "numbers" as
/// it says, with commas, each within "limits"; "whole"; "required"; "default", as it would be given.
const nlohmann::ordered_json& questions();

/// The question that is asked at `path`; null if there is none.
const nlohmann::ordered_json* find_question(std::string_view path);

/// The question whose answer is a stream of events: HttpServer.
constexpr const char* live_path = "/live";

/// What stands in the query of a request's URL, decoded.
using QueryParameters = std::multimap<std::string, std::string>;

/// The parameters that a request gives, checked: each of its kind and within its limits, no other ones.
class Values {
 public:
  /// Throws Error(usage) naming the parameter.
  Values(const nlohmann::ordered_json& question, const QueryParameters& given);

  bool has(const std::string& name) const { return numbers_.contains(name) || texts_.contains(name); }
  double number(const std::string& name) const { return numbers_.at(name)[0]; }
  const std::vector<double>& numbers(const std::string& name) const { return numbers_.at(name); }
  std::string text(const std::string& name) const { return texts_.at(name); }

 private:
  void take(const std::string& name, const nlohmann::ordered_json& parameter, const std::string& text);

  std::map<std::string, std::vector<double>> numbers_;  ///< with the defaults
  std::map<std::string, std::string> texts_;            ///< likewise
};

/// The name of the parameter that `option` ("--max-slope 3") is called in this question ("max_slope_deg");
/// `option` if it is none.
std::string parameter_of(const nlohmann::ordered_json& question, const std::string& option);

}  // namespace octosurf
