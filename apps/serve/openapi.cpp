#include "serve/questions.hpp"

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
using Kind = QuestionParameter::Kind;

constexpr const char* openapi_description =
    "A map's surfaces and a planner's questions about them. Map frame; metres and degrees. A refused request "
    "has a body {error, where, mend}: 400 for a question that makes no sense, 401 without the token, 404 "
    "where "
    "there is nothing of what is asked about, 503 with Retry-After when there are too many questions.";

constexpr const char* components = R"({
  "Point":{"type":"array","items":{"type":"number"},"minItems":3,"maxItems":3},
  "Ring":{"type":"array","items":{"$ref":"#/components/schemas/Point"}},
  "Polygon":{"type":"object","properties":{
    "outer":{"$ref":"#/components/schemas/Ring"},
    "holes":{"type":"array","items":{"$ref":"#/components/schemas/Ring"}}}},
  "Refusal":{"type":"string","nullable":true,"enum":["slope","size","roughness","uncertainty","support","margin",
    "frontier","obstacle","clearance",null]},
  "Footstep":{"type":"object","properties":{
    "foot":{"type":"string"},"surface":{"type":"integer"},"at":{"$ref":"#/components/schemas/Point"},
    "yaw_deg":{"type":"number"},
    "T_map_foot":{"type":"array","items":{"type":"number"},"minItems":16,"maxItems":16},
    "margin_m":{"type":"number"},"outline":{"$ref":"#/components/schemas/Ring"}}},
  "Error":{"type":"object","required":["error","where","mend"],"properties":{
    "error":{"type":"string"},"where":{"type":"string"},"mend":{"type":"string"}}}
})";

Json number_schema(const QuestionParameter& parameter) {
  return {{"type", parameter.kind == Kind::whole ? "integer" : "number"},
          {"minimum", parameter.low},
          {"maximum", parameter.high}};
}

Json schema_of(const QuestionParameter& parameter) {
  Json schema;
  if (parameter.kind == Kind::text)
    schema = {{"type", "string"}};
  else if (parameter.kind == Kind::numbers)
    schema = {{"type", "array"},
              {"items", number_schema(parameter)},
              {"minItems", parameter.count},
              {"maxItems", parameter.count}};
  else
    schema = number_schema(parameter);
  if (!parameter.words.empty()) schema["enum"] = parameter.words;
  if (!parameter.otherwise.is_null()) schema["default"] = parameter.otherwise;
  return schema;
}

Json content(Json schema, const char* type = "application/json") {
  return {{type, {{"schema", std::move(schema)}}}};
}

Json responses(Json ok) {
  return {{"200", {{"description", "the answer"}, {"content", std::move(ok)}}},
          {"default",
           {{"description", "refused"}, {"content", content({{"$ref", "#/components/schemas/Error"}})}}}};
}

Json path_of(const Question& question) {
  Json in_query = Json::array(), properties = Json::object(), required = Json::array();
  for (const QuestionParameter& parameter : question.parameters) {
    Json one{{"name", parameter.name},
             {"in", "query"},
             {"description", parameter.description},
             {"required", parameter.required},
             {"schema", schema_of(parameter)}};
    if (parameter.kind == Kind::numbers) {  // 1,2,3
      one["style"] = "form";
      one["explode"] = false;
    }
    in_query.push_back(std::move(one));
    properties[parameter.name] = schema_of(parameter);
    properties[parameter.name]["description"] = parameter.description;
    if (parameter.required) required.push_back(parameter.name);
  }
  const Json answer = responses(content({{"type", "object"}, {"properties", Json::parse(question.answer)}}));
  const Json body{{"type", "object"},
                  {"properties", std::move(properties)},
                  {"required", std::move(required)},
                  {"additionalProperties", false}};
  return {
      {"get", {{"summary", question.summary}, {"parameters", std::move(in_query)}, {"responses", answer}}},
      {"post",
       {{"summary", question.summary},
        {"requestBody", {{"required", true}, {"content", content(body)}}},
        {"responses", answer}}}};
}

/// What comes over a WebSocket OpenAPI has no words for.
constexpr const char* live_description =
    "Asked for as an upgrade to a WebSocket, by who may ask. Binary messages come, at most five a second: "
    "gzip "
    "of the length (32 bits, little-endian) of a JSON document, the document, and the arrays that its "
    "`arrays` "
    "lists as [type, place, count], little-endian. kind `changes`: surfaces and cylinders that appeared or "
    "changed, whole, and the ids of those gone, from revision `since` (null: forget all that was known) to "
    "`revision` of `run`. kind `voxels`, to who sends the text `voxels`, or `slices` for slices of free "
    "space, "
    "too. Who is slow gets fewer, larger messages; who answers no ping within 20 s is dropped, and may come "
    "back with `since` and `run`. Anything else that is sent ends it. How surfaces lie in the arrays is the "
    "page's affair (web/src/data.js) and may change; /api/changes is for programs.";

Json live_path() {
  Json get = path_of(live_question())["get"];
  get["description"] = live_description;
  get["responses"] = {
      {"101", {{"description", "a WebSocket from now on"}}},
      {"426", {{"description", "asked for without an upgrade"}}},
      {"default",
       {{"description", "refused"}, {"content", content({{"$ref", "#/components/schemas/Error"}})}}}};
  return {{"get", std::move(get)}};
}

Json page_path(const char* summary, Json ok) {
  return {{"get", {{"summary", summary}, {"responses", responses(std::move(ok))}}}};
}

}  // namespace

std::string openapi_json() {
  Json paths;
  const Json object{{"type", "object"}};
  paths["/"] = page_path("the page of octosurf view", content({{"type", "string"}}, "text/html"));
  paths["/api/info"] = page_path("what octosurf info --json prints", content(object));
  paths["/api/surfaces"] = page_path("what octosurf export writes as .json", content(object));
  paths["/openapi.json"] = page_path("this document", content(object));
  paths[live_question().path] = live_path();
  for (const Question& question : questions()) paths[question.path] = path_of(question);
  const Json document{
      {"openapi", "3.0.3"},
      {"info", {{"title", "octosurf serve"}, {"version", "1"}, {"description", openapi_description}}},
      {"paths", std::move(paths)},
      {"components",
       {{"schemas", Json::parse(components)},
        {"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}}},
      {"security", Json::array({Json::object(), {{"token", Json::array()}}})}};
  return document.dump(1) + "\n";
}

}  // namespace octosurf
