#include "serve/api.hpp"

#include "answers.hpp"
#include "query_fields.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include <octosurf/plan_files.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
using Fields = QuestionFields;
using std::literals::operator""sv;

constexpr double last_revision = 9007199254740991.0;  // JSON has no larger whole numbers
constexpr std::size_t longest_text = 64;
constexpr std::chrono::seconds longest_answer{20};  // plans wait for it

/// The parameters of all questions.
struct AskedByUrl : AskedOfMap {
  PlanQuery plan;
  std::optional<std::uint64_t> since;
  std::optional<Eigen::AlignedBox3d> box;
  SurfaceId surface = 0;
  std::string run;
};

struct UrlQuestion {
  std::string path, summary;
  std::function<Fields(AskedByUrl&)> fields;
};

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

QuestionField box_field(AskedByUrl& asked) {
  QuestionField field{"box", "two opposite corners, m: only surfaces whose bounding box meets it", 6,
                      -farthest_m, farthest_m};
  field.take = [&asked](const std::vector<double>& v) {
    const Eigen::Vector3d one(v.data()), other(v.data() + 3);
    asked.box.emplace(one.cwiseMin(other), one.cwiseMax(other));
  };
  return field;
}

const std::vector<UrlQuestion>& all_questions() {
  static const std::vector<UrlQuestion> all = [] {
    std::vector<UrlQuestion> questions;
    for (const MapQuestion& one : map_questions())
      questions.push_back({(one.name == "regions"sv ? "/api/" : "/api/query/") + std::string(one.name),
                           one.summary, one.fields});
    const auto add = [&](const char* path, const char* summary, auto fields) {
      questions.push_back({path, summary, fields});
    };
    add("/api/regions/all", "likewise on every surface",
        [](AskedByUrl& asked) { return region_fields(asked.contact); });
    add("/api/surface", "a surface as in /api/surfaces", [](AskedByUrl& asked) {
      return Fields{number_field("id", "its id", asked.surface, 1, last_id).needed()};
    });
    add("/api/changes",
        "what became of the surfaces since a revision, and those that appeared or changed as they are now",
        [](AskedByUrl& asked) {
          return Fields{since_field(asked, "a revision that /api/info or an earlier answer gave").needed(),
                        box_field(asked)};
        });
    add("/api/plan", "footsteps from one place to another, or why there are none", path_fields);
    add("/api/voxels", "the octree's occupied voxels, packed as for the page", [](AskedByUrl&) { return Fields{}; });
    add(live_path, "server-sent events: what changes on the map, as it changes", [](AskedByUrl& asked) {
      return Fields{since_field(asked, "the revision that is known; everything, if it is not given"),
                    text_field("run", "whose revision that is, as the events say", asked.run)};
    });
    return questions;
  }();
  return all;
}

/// Null if there is none.
const UrlQuestion* find_question(std::string_view path) {
  for (const UrlQuestion& question : all_questions())
    if (question.path == path) return &question;
  return nullptr;
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
  for (const UrlQuestion& question : all_questions()) {
    AskedByUrl asked;
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

/// Each of its kind and within its limits, no other ones.
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

/// The name of the parameter that `option` ("--max-slope 3") is called in this question ("max_slope_deg");
/// `option` if it is none.
std::string parameter_of(const UrlQuestion& question, const std::string& option) {
  AskedByUrl asked;
  for (const QuestionField& field : question.fields(asked))
    if (field.option() == option.substr(0, option.find(' '))) return field.name;
  return option;
}

std::string regions_answer(const ServedMap& map, planning::ContactQuestion question) {
  std::string answer = "{\"revision\":" + std::to_string(map.asked.snapshot->revision);
  answer += ",\"regions\":[";
  const char* before = "";
  const auto end = std::chrono::steady_clock::now() + longest_answer;
  for (const SurfacePtr& surface : map.asked.snapshot->surfaces) {
    if (std::chrono::steady_clock::now() > end)
      throw Error(Error::Kind::usage, "clearance_m", "takes too long on all surfaces of this map",
                  "ask /api/regions surface by surface, or give clearance_m=0");
    question.surface = surface->id;
    answer.append(before).append(region_json(planning::find_region(map.asked, question)));
    before = ",";
  }
  return answer.append("]}");
}

std::string answer_to(const ServedMap& map, const std::string& path, const AskedByUrl& asked) {
  if (path == "/api/query/foothold") return foothold_json(planning::find_foothold(map.asked, asked.contact));
  if (path == "/api/regions") return region_json(planning::find_region(map.asked, asked.contact));
  if (path == "/api/regions/all") return regions_answer(map, asked.contact);
  if (path == "/api/surface") return map.surface_json(asked.surface);
  if (path == "/api/changes") return map.changes_json(*asked.since, asked.box);
  const planning::PlaceAnswer found = planning::answer(map.asked, asked.place);
  require_found(map.asked, asked.place, found);
  return place_json(map.asked, asked.place, found);
}

}  // namespace

HttpReply Api::answer(const std::string& path, const QueryParameters& given) {
  const std::shared_ptr<const ServedMap> map = map_();
  if (path == "/") return {200, "text/html; charset=utf-8", map->page()};
  if (path == "/api") return json_reply(Json{{"questions", list_of_questions()}}.dump(1) + "\n");
  if (path == "/api/info") return {200, "application/json", map->info()};
  if (path == "/api/surfaces") return {200, "application/json", map->surfaces()};
  const UrlQuestion* question = find_question(path);
  if (question == nullptr)
    return refusal(404, "there is no such page", path.substr(0, longest_text),
                   "GET /api lists the questions");
  try {
    AskedByUrl asked;
    read(*question, given, asked);
    if (path == "/api/voxels") return {200, "application/octet-stream", map->voxels()};
    return json_reply((path == "/api/plan" ? plan(*map, asked.plan) : answer_to(*map, path, asked)) + "\n");
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::usage) throw;
    return refusal(400, error, parameter_of(*question, error.where()));
  }
}

std::function<ServedMap::Text()> Api::events(const QueryParameters& given) const {
  AskedByUrl asked;
  read(*find_question(live_path), given, asked);
  return [this, known = asked.since, run = asked.run]() mutable -> ServedMap::Text {
    const std::shared_ptr<const ServedMap> map = map_();
    const std::uint64_t revision = map->asked.snapshot->revision;
    if (run != map->run.name || known > revision) known.reset();
    if (known == revision) return nullptr;
    ServedMap::Text event = map->changes_event(known);
    known = revision;
    run = map->run.name;
    return event;
  };
}

std::string Api::plan(const ServedMap& map, const PlanQuery& query) {
  const Robot robot = robot_of(query, map.asked.up);
  Json key{map.asked.snapshot->revision, name_of(robot), query.unknown_is_free};
  if (query.foot) {
    key.push_back(query.foot->radius);
    for (const Eigen::Vector2d& corner : query.foot->outline) key.push_back(corner);
  }
  for (const auto& [limit, value] : query.limits) key.push_back({limit->name, value});
  const std::lock_guard lock(planning_);
  if (planned_for_ != key.dump()) {
    planner_ = std::make_unique<FootstepPlanner>(planner_on(map.asked, robot));
    planned_for_ = key.dump();
  }
  return to_json(planner_->plan(query.from, query.to, query.budget), robot);
}

}  // namespace octosurf
