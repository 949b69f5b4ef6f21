// From a request's query or body to checked parameters.
#include "serve/questions.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace octosurf {
namespace {

using Kind = QuestionParameter::Kind;

// No question has lists in lists.
constexpr int deepest = 4;
constexpr std::size_t longest_text = 64;

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& mend) {
  throw Error(Error::Kind::usage, where.substr(0, longest_text), what, mend);
}

int digit_of(char c) {
  if ('0' <= c && c <= '9') return c - '0';
  if ('a' <= c && c <= 'f') return c - 'a' + 10;
  if ('A' <= c && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// "a%2Cb+c" as "a,b c".
std::string decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i] == '+' ? ' ' : text[i];
      continue;
    }
    const int high = i + 2 < text.size() ? digit_of(text[i + 1]) : -1;
    const int low = high >= 0 ? digit_of(text[i + 2]) : -1;
    if (low < 0) refuse("query", "has a % without two hexadecimal digits", "write %25 for %");
    result += static_cast<char>(high << 4 | low);
    i += 2;
  }
  return result;
}

nlohmann::json number_in(const std::string& name, std::string_view text) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size())
    refuse(name, "is no number", "write it as 1.25 or 1e-3");
  return value;
}

/// "1,2,3"
nlohmann::json numbers_in(const std::string& name, std::string_view text) {
  nlohmann::json list = nlohmann::json::array();
  for (;;) {
    const std::size_t comma = text.find(',');
    list.push_back(number_in(name, text.substr(0, comma)));
    if (comma == std::string_view::npos) return list;
    text.remove_prefix(comma + 1);
  }
}

const QuestionParameter& parameter_named(const Question& question, const std::string& name) {
  for (const QuestionParameter& parameter : question.parameters)
    if (parameter.name == name) return parameter;
  std::string names;
  for (const QuestionParameter& parameter : question.parameters)
    names += (names.empty() ? "" : ", ") + parameter.name;
  refuse(name, "is no parameter of this question", "it has " + names);
}

nlohmann::json from_query(const Question& question, std::string_view query) {
  nlohmann::json object = nlohmann::json::object();
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), pair.size() + 1));
    if (pair.empty()) continue;
    const std::size_t equals = pair.find('=');
    const std::string name = decoded(pair.substr(0, equals));
    const std::string text = equals == std::string_view::npos ? "" : decoded(pair.substr(equals + 1));
    const QuestionParameter& parameter = parameter_named(question, name);
    if (object.contains(name)) refuse(name, "is given twice", "give it once");
    if (parameter.kind == Kind::text)
      object[name] = text;
    else
      object[name] = parameter.kind == Kind::numbers ? numbers_in(name, text) : number_in(name, text);
  }
  return object;
}

nlohmann::json from_body(const HttpRequest& request) {
  // What a page of another site can send without asking this server first is not of this type.
  if (!request.type.starts_with("application/json"))
    refuse("Content-Type", "is not application/json", "send the question as JSON");
  nlohmann::json object;
  try {
    object =
        nlohmann::json::parse(request.body, [](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
          if (depth > deepest) refuse("body", "is nested too deep", "no question has lists in lists");
          return true;
        });
  } catch (const nlohmann::json::exception& error) {
    refuse("body", std::string("is no JSON: ") + error.what(), "send an object with the parameters");
  }
  if (!object.is_object()) refuse("body", "is no JSON object", "send an object with the parameters");
  return object;
}

void check_number(const QuestionParameter& parameter, const nlohmann::json& value) {
  if (!value.is_number()) refuse(parameter.name, "is no number", "give one");
  const double number = value.get<double>();
  // Written so that NaN is refused, too.
  if (!(number >= parameter.low && number <= parameter.high))
    refuse(parameter.name, "is not within its limits",
           "give " + nlohmann::json(parameter.low).dump() + " to " + nlohmann::json(parameter.high).dump());
  if (parameter.kind == Kind::whole && number != std::floor(number))
    refuse(parameter.name, "is no whole number", "give one");
}

void check(const QuestionParameter& parameter, const nlohmann::json& value) {
  if (parameter.kind == Kind::text) {
    if (!value.is_string()) refuse(parameter.name, "is no text", "give one in quotes");
    const std::string& text = value.get_ref<const std::string&>();
    if (text.size() > longest_text) refuse(parameter.name, "is too long", "give fewer letters");
    const std::vector<std::string>& words = parameter.words;
    if (!words.empty() && std::find(words.begin(), words.end(), text) == words.end())
      refuse(parameter.name, "is none of its words", parameter.description);
  } else if (parameter.kind == Kind::numbers) {
    if (!value.is_array() || value.size() != parameter.count)
      refuse(parameter.name, "is not " + std::to_string(parameter.count) + " numbers", parameter.description);
    for (const nlohmann::json& one : value) check_number(parameter, one);
  } else {
    check_number(parameter, value);
  }
}

}  // namespace

Values::Values(const Question& question, const HttpRequest& request)
    : json_(request.method == "POST" ? from_body(request) : from_query(question, request.query)) {
  for (const auto& [name, value] : json_.items()) check(parameter_named(question, name), value);
  for (const QuestionParameter& parameter : question.parameters) {
    if (has(parameter.name)) continue;
    if (parameter.required) refuse(parameter.name, "is missing", parameter.description);
    if (!parameter.otherwise.is_null()) json_[parameter.name] = parameter.otherwise;
  }
}

}  // namespace octosurf
