#include "serve/questions.hpp"

#include "plan_query.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {
namespace {

using Kind = QuestionParameter::Kind;
using Parameters = std::vector<QuestionParameter>;

// Farther off than any octree reaches (65,536 voxels), and numbers still keep their micrometres there.
constexpr double far = 1e6;
// Larger than any robot; what stands within it of a foot is looked at voxel by voxel.
constexpr double robot_size = 10;
// Ids are 32 bits.
constexpr double last_id = 4294967295.0;
// Whole numbers beyond it are not told apart in JSON.
constexpr double last_revision = 9007199254740991.0;
constexpr std::size_t longest_text = 64;

QuestionParameter place(const char* name, const char* description, std::size_t count = 3) {
  return {name, Kind::number, description, -far, far, count, true};
}

QuestionParameter max_slope() {
  return {"max_slope_deg",
          Kind::number,
          "only surfaces that slope so much at most; 90 leaves out ceilings",
          0,
          180,
          1,
          false,
          "180"};
}

QuestionParameter foot(const char* otherwise) {
  return {"foot", Kind::text, "LENGTHxWIDTH of a sole, or the radius of a disc, m", 0, 0, 1,
          false,  otherwise};
}

QuestionParameter margin(const char* name, const char* description) {
  return {name, Kind::number, description, 0, robot_size, 1, false, "0"};
}

QuestionParameter heading(bool required) {
  return {
      "yaw_deg", Kind::number, required ? "heading, degrees" : "heading, degrees; any, if it is not given",
      -3600,     3600,         1,
      required};
}

/// Of both footholds and contact regions.
Parameters with_contact(Parameters parameters) {
  for (const QuestionParameter& more :
       {foot("0.22x0.11"), max_slope(), margin("edge_margin_m", "of a foot to every edge"),
        margin("frontier_margin_m", "to edges that nobody has looked beyond"),
        margin("obstacle_margin_m", "to what stands there, up to clearance_m"),
        margin("clearance_m", "over the foot, in which nothing may stand or hang; 0: any"),
        margin("gap_depth_m",
               "no foot where the space is free from the plane to so far behind it; 0: anywhere")})
    parameters.push_back(more);
  return parameters;
}

Parameters plan_parameters() {
  const PlanBudget budget;
  Parameters parameters{
      place("from", "x, y, z, m, on the ground between the feet, and the heading, degrees", 4),
      place("to", "likewise", 4),
      {"robot", Kind::text, "biped or quadruped", 0, 0, 1, false, "biped", {"biped", "quadruped"}},
      foot(""),
      {"budget", Kind::whole, "expansions to find a plan", 1, 100000, 1, false,
       std::to_string(budget.expansions)},
      {"improving", Kind::whole, "further expansions to find a better one", 0, 100000, 1, false,
       std::to_string(budget.improving)},
      {"time_s", Kind::number, "of search at most", 0, 30, 1, false, "10"}};
  for (const LimitOption& option : limit_options()) {
    std::string name = option.name + 2;  // without its dashes
    std::replace(name.begin(), name.end(), '-', '_');
    const bool angle = option.unit != 1;
    parameters.push_back(
        {name + (angle ? "_deg" : "_m"), Kind::number, option.help, 0, angle ? 180 : robot_size});
  }
  return parameters;
}

std::vector<Question> make_questions() {
  return {
      {"/api/query/box",
       "ids of the surfaces in a box between two corners",
       {place("min", "a corner, m"), place("max", "the opposite one, m")}},
      {"/api/query/sphere",
       "ids of the surfaces within a distance of a point",
       {place("center", "m"), {"radius_m", Kind::number, "m", 0, far, 1, true}}},
      {"/api/query/ray",
       "the first surface along a ray",
       {place("from", "where it begins, m"), place("direction", "of any length")}},
      {"/api/query/voxel", "the voxel that holds a point: its state, and whose it is", {place("point", "m")}},
      {"/api/query/nearest",
       "the place on a surface that is nearest to a point",
       {place("point", "m"), max_slope()}},
      {"/api/query/below",
       "the place on a surface that is met first straight below a point",
       {place("point", "m"), max_slope()}},
      {"/api/query/foothold",
       "what a foot would stand on, on the surface nearest to a point, or why it cannot",
       with_contact({place("point", "m"), heading(true)})},
      {"/api/regions", "where on a surface the middle of a foot may be, so that all of it is supported",
       with_contact(
           {{"surface", Kind::whole, "its id", 1, last_id, 1, true},
            heading(false),
            {"pieces", Kind::whole, "at most so many convex pieces of it, too", 0, 200, 1, false, "0"}})},
      {"/api/regions/all", "likewise on every surface", with_contact({heading(false)})},
      {"/api/changes",
       "what became of the surfaces since a revision, and those that appeared or changed as they are now",
       {{"since", Kind::whole, "a revision that /api/info or an earlier answer gave", 0, last_revision, 1,
         true}}},
      {"/api/plan", "footsteps from one place to another, or why there are none", plan_parameters()},
      {"/api/voxels",
       "the octree's occupied voxels, packed as for the page",
       {{"slices", Kind::whole, "1: with slices of free space", 0, 1, 1, false, "0"}}},
      {live_path,
       "server-sent events: what changes on the map, as it changes",
       {{"since", Kind::whole, "the revision that is known; everything, if it is not given", 0,
         last_revision},
        {"run", Kind::text, "whose revision that is, as the events say"}}},
  };
}

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& mend) {
  throw Error(Error::Kind::usage, where.substr(0, longest_text), what, mend);
}

const QuestionParameter& parameter_named(const Question& question, const std::string& name) {
  std::string names;
  for (const QuestionParameter& parameter : question.parameters) {
    if (parameter.name == name) return parameter;
    names += (names.empty() ? "" : ", ") + parameter.name;
  }
  refuse(name, "is no parameter of this question", "it has " + names);
}

double number_in(const QuestionParameter& parameter, std::string_view text) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size())
    refuse(parameter.name, "is no number", "write it as 1.25 or 1e-3");
  // Written so that NaN is refused, too.
  if (!(value >= parameter.low && value <= parameter.high))
    refuse(parameter.name, "is not within its limits",
           "give " + nlohmann::json(parameter.low).dump() + " to " + nlohmann::json(parameter.high).dump());
  if (parameter.kind == Kind::whole && value != std::floor(value))
    refuse(parameter.name, "is no whole number", "give one");
  return value;
}

}  // namespace

const std::vector<Question>& questions() {
  static const std::vector<Question> all = make_questions();
  return all;
}

const Question* find_question(std::string_view path) {
  const auto found = std::find_if(questions().begin(), questions().end(),
                                  [&](const Question& question) { return question.path == path; });
  return found == questions().end() ? nullptr : &*found;
}

std::string questions_json() {
  using Json = nlohmann::ordered_json;
  Json all = Json::array();
  for (const Question& question : questions()) {
    Json& one = all.emplace_back(Json{{"path", question.path}, {"summary", question.summary}});
    for (const QuestionParameter& parameter : question.parameters) {
      Json& given = one["parameters"][parameter.name];
      given["description"] = parameter.description;
      if (parameter.kind == Kind::text) {
        given["words"] = parameter.words;
      } else {
        given["numbers"] = parameter.count;
        given["whole"] = parameter.kind == Kind::whole;
        given["limits"] = {parameter.low, parameter.high};
      }
      given["required"] = parameter.required;
      if (!parameter.otherwise.empty()) given["default"] = parameter.otherwise;
    }
  }
  return Json{{"questions", std::move(all)}}.dump(1) + "\n";
}

Values::Values(const Question& question, const QueryParameters& given) {
  for (const auto& [name, text] : given) {
    const QuestionParameter& parameter = parameter_named(question, name);
    if (given.count(name) > 1) refuse(name, "is given twice", "give it once");
    take(parameter, text);
  }
  for (const QuestionParameter& parameter : question.parameters) {
    if (has(parameter.name)) continue;
    if (parameter.required) refuse(parameter.name, "is missing", parameter.description);
    if (!parameter.otherwise.empty()) take(parameter, parameter.otherwise);
  }
}

void Values::take(const QuestionParameter& parameter, const std::string& text) {
  if (parameter.kind == Kind::text) {
    if (text.size() > longest_text) refuse(parameter.name, "is too long", "give fewer letters");
    const std::vector<std::string>& words = parameter.words;
    if (!words.empty() && std::find(words.begin(), words.end(), text) == words.end())
      refuse(parameter.name, "is none of its words", parameter.description);
    texts_[parameter.name] = text;
    return;
  }
  if (static_cast<std::size_t>(std::count(text.begin(), text.end(), ',')) + 1 != parameter.count)
    refuse(parameter.name, "is not " + std::to_string(parameter.count) + " numbers", parameter.description);
  std::vector<double>& numbers = numbers_[parameter.name];
  for (std::string_view rest = text; numbers.size() < parameter.count;) {
    const std::size_t length = std::min(rest.find(','), rest.size());
    numbers.push_back(number_in(parameter, rest.substr(0, length)));
    rest.remove_prefix(std::min(length + 1, rest.size()));
  }
}

std::string parameter_of(const Question& question, const std::string& option) {
  if (!option.starts_with("--")) return option;
  std::string base = option.substr(2, option.find(' ') - 2);
  std::replace(base.begin(), base.end(), '-', '_');
  for (const QuestionParameter& parameter : question.parameters)
    for (const char* unit : {"", "_m", "_deg", "_s"})
      if (parameter.name == base + unit) return parameter.name;
  return option;
}

}  // namespace octosurf
