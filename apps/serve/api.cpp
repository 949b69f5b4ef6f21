#include "serve/api.hpp"

#include "questions.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t longest_text = 64;

HttpReply json_reply(std::string body) {
  return {200, "application/json", std::make_shared<const std::string>(std::move(body))};
}

/// Of a parameter: a text, with the "words" that it may be (none: anything short), or as many "numbers" as it
/// says, with commas, each within "limits".
Json described(const QuestionField& field) {
  Json json{{"description", field.description}};
  if (field.numbers == 0) {
    json["words"] = field.words;
  } else {
    json["numbers"] = field.numbers;
    json["whole"] = field.whole;
    json["limits"] = {field.low, field.high};
  }
  json["required"] = field.required;
  if (!field.usual.empty()) json["default"] = field.usual;
  return json;
}

Json list_of_questions() {
  Json all = Json::array();
  for (const Question& question : questions()) {
    if (*question.path == 0) continue;
    Request asked;
    Json parameters = Json::object();
    for (const QuestionField& field : question.fields(asked)) parameters[field.name] = described(field);
    all.push_back({{"path", question.path},
                   {"method", "GET"},
                   {"summary", question.summary},
                   {"parameters", parameters}});
  }
  return all;
}

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& hint) {
  throw Error(Error::Kind::usage, where.substr(0, longest_text), what, hint);
}

void take(const QuestionField& field, const std::string& text) {
  if (field.numbers == 0) {
    if (text.size() > longest_text) refuse(field.name, "is too long", "give fewer letters");
    if (!field.words.empty() && std::ranges::find(field.words, text) == field.words.end())
      refuse(field.name, "is none of its words", field.description);
    return field.take_text(text);
  }
  if (static_cast<std::size_t>(std::count(text.begin(), text.end(), ',')) + 1 != field.numbers)
    refuse(field.name, "is not " + std::to_string(field.numbers) + " numbers", field.description);
  std::vector<double> numbers(field.numbers);
  const char *at = text.data(), *const end = at + text.size();
  for (double& number : numbers) {
    const auto [behind, failure] = std::from_chars(at, end, number);
    if (failure != std::errc() || (behind != end && *behind != ','))
      refuse(field.name, "is no number", "write it as 1.25 or 1e-3");
    at = std::min(behind + 1, end);
  }
  field.put(numbers, field.name);
}

/// Each of its kind and within its limits, no other ones.
void read(const Question& question, const QueryParameters& given, Request& asked) {
  const QuestionFields fields = question.fields(asked);
  for (const auto& [name, text] : given) {
    const auto known = [&name = name](const QuestionField& field) { return field.name == name; };
    if (std::ranges::none_of(fields, known)) {
      std::string names;
      for (const QuestionField& field : fields) names += (names.empty() ? "" : ", ") + field.name;
      refuse(name, "is no parameter of this question", "it has " + names);
    }
    if (given.count(name) > 1) refuse(name, "is given twice", "give it once");
  }
  for (const QuestionField& field : fields) {
    const auto one = given.find(field.name);
    if (one == given.end() && field.required) refuse(field.name, "is missing", field.description);
    const std::string& text = one != given.end() ? one->second : field.usual;
    if (one != given.end() || !text.empty()) take(field, text);
  }
}

/// The name of the parameter that `option` ("--max-slope 3") is called in this question ("max_slope_deg");
/// `option` if it is none.
std::string parameter_of(const Question& question, const std::string& option) {
  Request asked;
  for (const QuestionField& field : question.fields(asked))
    if (field.option() == option.substr(0, option.find(' '))) return field.name;
  return option;
}

/// Null if there is none.
const Question* find_question(std::string_view path) {
  const auto at = std::find_if(questions().begin(), questions().end(),
                               [&](const Question& question) { return question.path == path; });
  return at != questions().end() && !path.empty() ? &*at : nullptr;
}

}  // namespace

HttpReply refusal(int status, const std::string& what, const std::string& where, const std::string& hint) {
  const Json json{{"error", what}, {"where", where}, {"hint", hint}};
  HttpReply reply = json_reply(json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
  reply.status = status;
  return reply;
}

HttpReply refusal(int status, const Error& error, const std::string& where) {
  // what() is "where: what; hint", with parts that are empty left out.
  std::string what = error.what();
  if (!error.where().empty()) what.erase(0, error.where().size() + 2);
  if (!error.hint().empty()) what.erase(what.size() - error.hint().size() - 2);
  return refusal(status, what, where, error.hint());
}

HttpReply answer_to(const ServedMap& map, const std::string& path, const QueryParameters& given) {
  if (path == "/") return {200, "text/html; charset=utf-8", map.page_html()};
  if (path == "/api") return json_reply(Json{{"questions", list_of_questions()}}.dump(1) + "\n");
  if (path == "/api/info") return {200, "application/json", map.info()};
  if (path == "/api/surfaces") return {200, "application/json", map.surfaces()};
  const Question* question = find_question(path);
  if (question == nullptr)
    return refusal(404, "there is no such page", path.substr(0, longest_text),
                   "GET /api lists the questions");
  try {
    Request asked;
    read(*question, given, asked);
    if (path == voxels_path) return {200, "application/octet-stream", map.voxels()};
    return json_reply(question->answer(map, asked) + "\n");
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::usage) throw;
    return refusal(400, error, parameter_of(*question, error.where()));
  }
}

}  // namespace octosurf
