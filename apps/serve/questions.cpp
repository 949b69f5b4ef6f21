#include "serve/questions.hpp"

#include "geometry/degrees.hpp"

#include <algorithm>
#include <charconv>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
using Fields = QuestionFields;
using std::literals::operator""sv;

// Whole numbers beyond it are not told apart in JSON.
constexpr double last_revision = 9007199254740991.0;
constexpr std::size_t longest_text = 64;

Fields path_fields(AskedByUrl& asked) {
  Fields fields = plan_fields(asked.plan);
  PlanBudget& budget = asked.plan.budget;
  fields.push_back(number_field("budget", "expansions to find a plan", budget.expansions, 1, 100000)
                       .by_default(std::to_string(budget.expansions)));
  fields.push_back(
      number_field("improving", "further expansions to find a better one", budget.improving, 0, 100000)
          .by_default(std::to_string(budget.improving)));
  fields.push_back(number_field("time_s", "of search at most", budget.time_s, 0, 30).by_default("10"));
  return fields;
}

QuestionField since_field(AskedByUrl& asked, const char* description) {
  QuestionField field{"since", description, 1, 0, last_revision, true};
  field.take = [&asked](const std::vector<double>& v) { asked.since = static_cast<std::uint64_t>(v[0]); };
  return field;
}

QuestionField box_field(AskedByUrl& asked, const char* description) {
  QuestionField field{"box", description, 6, -farthest_m, farthest_m};
  field.take = [&asked](const std::vector<double>& v) {
    const Eigen::Vector3d one(v.data()), other(v.data() + 3);
    asked.box.emplace(one.cwiseMin(other), one.cwiseMax(other));
  };
  return field;
}

const std::vector<UrlQuestion> own_questions = {
    {"/api/regions/all", "likewise on every surface",
     [](AskedByUrl& asked) { return region_fields(asked.contact); }},
    {"/api/surface", "a surface as in /api/surfaces",
     [](AskedByUrl& asked) {
       return Fields{number_field("id", "its id", asked.surface, 1, last_id).needed()};
     }},
    {"/api/changes",
     "what became of the surfaces since a revision, and those that appeared or changed as they are now",
     [](AskedByUrl& asked) {
       return Fields{
           since_field(asked, "a revision that /api/info or an earlier answer gave").needed(),
           box_field(asked, "two opposite corners, m: only surfaces with outlines whose own boxes meet it")};
     }},
    {clear_path, "takes back what the map knows of a box or a cylinder, if the server allows it",
     [](AskedByUrl& asked) {
       QuestionField cylinder{"cylinder", "upright: the middle of its base, radius, height, m", 5,
                              -farthest_m, farthest_m};
       cylinder.take = [&asked](const std::vector<double>& v) {
         asked.cylinder = SpacePart::cylinder({v[0], v[1], v[2]}, v[3], v[4]);
       };
       return Fields{box_field(asked, "two opposite corners, m"), cylinder,
                     number_field("free", "what was known becomes free, not unknown", asked.as_free, 0, 1)
                         .by_default("0")};
     }},
    {"/api/plan", "footsteps from one place to another, or why there are none", path_fields},
    {live_path, "server-sent events: what changes on the map, as it changes", [](AskedByUrl& asked) {
       return Fields{since_field(asked, "the revision that is known; everything, if it is not given"),
                     text_field("run", "whose revision that is, as the events say", asked.run)};
     }}};

const std::vector<UrlQuestion>& all_questions() {
  static const std::vector<UrlQuestion> all = [] {
    std::vector<UrlQuestion> questions;
    for (const MapQuestion& one : map_questions())
      questions.push_back({(one.name == "regions"sv ? "/api/" : "/api/query/") + std::string(one.name),
                           one.summary, one.fields});
    questions.insert(questions.end(), own_questions.begin(), own_questions.end());
    return questions;
  }();
  return all;
}

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

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& hint) {
  throw Error(Error::Kind::usage, where.substr(0, longest_text), what, hint);
}

double number_in(const QuestionField& field, std::string_view text) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size())
    refuse(field.name, "is no number", "write it as 1.25 or 1e-3");
  return value;
}

void take(const QuestionField& field, const std::string& text) {
  if (field.numbers == 0) {
    if (text.size() > longest_text) refuse(field.name, "is too long", "give fewer letters");
    if (!field.words.empty() && std::find(field.words.begin(), field.words.end(), text) == field.words.end())
      refuse(field.name, "is none of its words", field.description);
    return field.take_text(text);
  }
  if (static_cast<std::size_t>(std::count(text.begin(), text.end(), ',')) + 1 != field.numbers)
    refuse(field.name, "is not " + std::to_string(field.numbers) + " numbers", field.description);
  std::vector<double> numbers;
  for (std::string_view rest = text; numbers.size() < field.numbers;) {
    const std::size_t length = std::min(rest.find(','), rest.size());
    numbers.push_back(number_in(field, rest.substr(0, length)));
    rest.remove_prefix(std::min(length + 1, rest.size()));
  }
  field.put(numbers, field.name);
}

}  // namespace

Json list_of_questions() {
  Json all = Json::array();
  for (const UrlQuestion& question : all_questions()) {
    AskedByUrl asked;
    Json parameters = Json::object();
    for (const QuestionField& field : question.fields(asked)) parameters[field.name] = described(field);
    all.push_back({{"path", question.path},
                   {"method", question.path == clear_path ? "POST" : "GET"},
                   {"summary", question.summary},
                   {"parameters", parameters}});
  }
  return all;
}

const UrlQuestion* find_question(std::string_view path) {
  for (const UrlQuestion& question : all_questions())
    if (question.path == path) return &question;
  return nullptr;
}

QueryParameters parameters_in(const std::string& json) {
  const Json body = Json::parse(json, nullptr, false);
  if (!body.is_object()) refuse("body", "is no JSON object", R"(send one as {"box": [0, 0, 0, 1, 1, 2]})");
  QueryParameters given;
  for (const auto& [name, value] : body.items()) {
    std::string text = value.is_boolean() ? (value.get<bool>() ? "1" : "0") : value.dump();
    std::erase_if(text, [](char c) { return c == '[' || c == ']'; });
    given.emplace(name, text);
  }
  return given;
}

void read(const UrlQuestion& question, const QueryParameters& given, AskedByUrl& asked) {
  const Fields fields = question.fields(asked);
  for (const auto& [name, text] : given) {
    const auto known = [&name = name](const QuestionField& field) { return field.name == name; };
    if (std::none_of(fields.begin(), fields.end(), known)) {
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

std::string parameter_of(const UrlQuestion& question, const std::string& option) {
  AskedByUrl asked;
  for (const QuestionField& field : question.fields(asked))
    if (field.option() == option.substr(0, option.find(' '))) return field.name;
  return option;
}

}  // namespace octosurf
