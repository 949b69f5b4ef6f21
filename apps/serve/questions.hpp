#pragma once

#include "query_fields.hpp"

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include <octosurf/space_part.hpp>

namespace octosurf {

/// What a request may ask for; each question has its part of it.
struct AskedByUrl : AskedOfMap {
  PlanQuery plan;
  std::optional<std::uint64_t> since;
  std::optional<Eigen::AlignedBox3d> box;
  std::optional<SpacePart> cylinder;
  bool as_free = false;
  SurfaceId surface = 0;
  std::string run;
};

/// A question at `path`, and its parameters, which write to what is asked.
struct UrlQuestion {
  std::string path, summary;
  std::function<QuestionFields(AskedByUrl&)> fields;
};

/// As GET /api lists them: [{"path", "method", "summary", "parameters": {NAME: {"description", …}}}]. A
/// parameter is a text, with the "words" that it may be (none: anything short), or has as many "numbers" as
/// it says, with commas, each within "limits"; "whole"; "required"; "default", as it would be given.
nlohmann::ordered_json list_of_questions();

/// The question that is asked at `path`; null if there is none.
const UrlQuestion* find_question(std::string_view path);

/// The question whose answer is a stream of events: HttpServer.
constexpr const char* live_path = "/live";

/// The one that changes the map: POST, with its parameters as a JSON object.
constexpr const char* clear_path = "/api/clear";

/// What stands in the query of a request's URL, decoded.
using QueryParameters = std::multimap<std::string, std::string>;

/// What stands in a JSON object. Throws Error(usage) for anything else.
QueryParameters parameters_in(const std::string& json);

/// Reads a request's parameters: each of its kind and within its limits, no other ones. Throws Error(usage)
/// naming the parameter.
void read(const UrlQuestion& question, const QueryParameters& given, AskedByUrl& asked);

/// The name of the parameter that `option` ("--max-slope 3") is called in this question ("max_slope_deg");
/// `option` if it is none.
std::string parameter_of(const UrlQuestion& question, const std::string& option);

}  // namespace octosurf
