#include "serve/questions.hpp"

#include "plan_query.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

// Farther off than any octree reaches (65,536 voxels), and numbers still keep their micrometres there.
constexpr double far = 1e6;
// Larger than any robot; what stands within it of a foot is looked at voxel by voxel.
constexpr double robot_size = 10;
// Ids are 32 bits.
constexpr double last_id = 4294967295.0;
// Whole numbers beyond it are not told apart in JSON.
constexpr double last_revision = 9007199254740991.0;
constexpr std::size_t longest_text = 64;

Json number(const std::string& description, double low, double high, int count = 1, bool whole = false) {
  return {{"description", description},
          {"numbers", count},
          {"whole", whole},
          {"limits", {low, high}},
          {"required", false}};
}

Json whole(const std::string& description, double low, double high) {
  return number(description, low, high, 1, true);
}

Json text(const char* description, const std::vector<const char*>& words = {}) {
  return {{"description", description}, {"words", words}, {"required", false}};
}

Json required(Json parameter) {
  parameter["required"] = true;
  return parameter;
}

Json by_default(const std::string& value, Json parameter) {
  parameter["default"] = value;
  return parameter;
}

Json place(const char* description, int count = 3) { return required(number(description, -far, far, count)); }

Json with_slope(Json parameters) {
  parameters["max_slope_deg"] =
      by_default("180", number("only surfaces that slope so much at most; 90 leaves out ceilings", 0, 180));
  return parameters;
}

constexpr const char* foot = "LENGTHxWIDTH of a sole, or the radius of a disc, m";

/// Of both footholds and contact regions.
Json with_contact(Json parameters) {
  parameters["robot"] = by_default("biped", text("whose foot and limits hold", {"biped", "quadruped"}));
  parameters["foot"] = text(foot);
  parameters["max_slope_deg"] = number("of the surface; 30, if it is not given", 0, 180);
  parameters["as_mapped"] = by_default("0", whole("1: outlines of readings, which are no ground", 0, 1));
  for (const auto& [name, description] : std::initializer_list<std::pair<const char*, const char*>>{
           {"edge_margin_m", "of a foot to every edge; the map's resolution, if it is not given"},
           {"frontier_margin_m", "to edges that nobody has looked beyond; 0, if it is not given"},
           {"obstacle_margin_m", "to what stands there, up to clearance_m; likewise the resolution"},
           {"clearance_m",
            "over the foot, in which nothing may stand or hang; the robot's, if it is not given"}})
    parameters[name] = number(description, 0, robot_size);
  return parameters;
}

Json plan_parameters() {
  const PlanBudget budget;
  Json parameters{{"from", place("x, y, z, m, on the ground between the feet, and the heading, degrees", 4)},
                  {"to", place("likewise", 4)},
                  {"robot", by_default("biped", text("biped or quadruped", {"biped", "quadruped"}))},
                  {"foot", text(foot)},
                  {"budget", by_default(std::to_string(budget.expansions),
                                        whole("expansions to find a plan", 1, 100000))},
                  {"improving", by_default(std::to_string(budget.improving),
                                           whole("further expansions to find a better one", 0, 100000))},
                  {"time_s", by_default("10", number("of search at most", 0, 30))}};
  for (const LimitOption& option : limit_options()) {
    std::string name = option.name + 2;  // without its dashes
    std::replace(name.begin(), name.end(), '-', '_');
    const bool angle = option.unit != 1;
    parameters[name + (angle ? "_deg" : "_m")] = number(option.help, 0, angle ? 180 : robot_size);
  }
  return parameters;
}

Json make_questions() {
  const Json heading = number("heading, degrees; any, if it is not given", -3600, 3600);
  Json all = Json::array();
  const auto add = [&](const char* path, const char* summary, Json parameters) {
    all.push_back({{"path", path}, {"summary", summary}, {"parameters", std::move(parameters)}});
  };
  add("/api/query/box", "ids of the surfaces in a box between two corners",
      {{"min", place("a corner, m")}, {"max", place("the opposite one, m")}});
  add("/api/query/sphere", "ids of the surfaces within a distance of a point",
      {{"center", place("m")}, {"radius_m", required(number("m", 0, far))}});
  add("/api/query/ray", "the first surface along a ray",
      {{"from", place("where it begins, m")}, {"direction", place("of any length")}});
  add("/api/query/voxel", "the voxel that holds a point: its state, and whose it is",
      {{"point", place("m")}});
  add("/api/query/nearest", "the place on a surface that is nearest to a point",
      with_slope({{"point", place("m")}}));
  add("/api/query/below", "the place on a surface that is met first straight below a point",
      with_slope({{"point", place("m")}}));
  add("/api/query/foothold",
      "what a foot would stand on, on the surface nearest to a point, or why it cannot",
      with_contact({{"point", place("m")}, {"yaw_deg", required(number("heading, degrees", -3600, 3600))}}));
  add("/api/regions", "where on a surface the middle of a foot may be, so that all of it is supported",
      with_contact({{"surface", required(whole("its id", 1, last_id))},
                    {"yaw_deg", heading},
                    {"about", number("only what is near this place, m", -far, far, 3)},
                    {"reach_m", by_default("1", number("of a region about a place, along the surface's axes",
                                                       0.001, robot_size))},
                    {"pieces", by_default("0", whole("at most so many convex pieces of it, too", 0, 200))}}));
  add("/api/regions/all", "likewise on every surface", with_contact({{"yaw_deg", heading}}));
  add("/api/changes",
      "what became of the surfaces since a revision, and those that appeared or changed as they are now",
      {{"since", required(whole("a revision that /api/info or an earlier answer gave", 0, last_revision))}});
  add("/api/plan", "footsteps from one place to another, or why there are none", plan_parameters());
  add("/api/voxels", "the octree's occupied voxels, packed as for the page",
      {{"slices", by_default("0", whole("1: with slices of free space", 0, 1))}});
  add(live_path, "server-sent events: what changes on the map, as it changes",
      {{"since", whole("the revision that is known; everything, if it is not given", 0, last_revision)},
       {"run", text("whose revision that is, as the events say")}});
  return all;
}

[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& hint) {
  throw Error(Error::Kind::usage, where.substr(0, longest_text), what, hint);
}

double number_in(const std::string& name, const Json& parameter, std::string_view text) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size())
    refuse(name, "is no number", "write it as 1.25 or 1e-3");
  const Json &low = parameter["limits"][0], &high = parameter["limits"][1];
  // Written so that NaN is refused, too.
  if (!(value >= low.get<double>() && value <= high.get<double>()))
    refuse(name, "is not within its limits", "give " + low.dump() + " to " + high.dump());
  if (parameter["whole"] && value != std::floor(value)) refuse(name, "is no whole number", "give one");
  return value;
}

}  // namespace

const Json& questions() {
  static const Json all = make_questions();
  return all;
}

const Json* find_question(std::string_view path) {
  for (const Json& question : questions())
    if (question["path"] == path) return &question;
  return nullptr;
}

Values::Values(const Json& question, const QueryParameters& given) {
  const Json& parameters = question["parameters"];
  for (const auto& [name, text] : given) {
    if (!parameters.contains(name)) {
      std::string names;
      for (const auto& [known, one] : parameters.items()) names += (names.empty() ? "" : ", ") + known;
      refuse(name, "is no parameter of this question", "it has " + names);
    }
    if (given.count(name) > 1) refuse(name, "is given twice", "give it once");
    take(name, parameters[name], text);
  }
  for (const auto& [name, parameter] : parameters.items()) {
    if (has(name)) continue;
    if (parameter["required"]) refuse(name, "is missing", parameter["description"]);
    if (parameter.contains("default")) take(name, parameter, parameter["default"]);
  }
}

void Values::take(const std::string& name, const Json& parameter, const std::string& text) {
  if (parameter.contains("words")) {
    if (text.size() > longest_text) refuse(name, "is too long", "give fewer letters");
    const Json& words = parameter["words"];
    if (!words.empty() && std::find(words.begin(), words.end(), text) == words.end())
      refuse(name, "is none of its words", parameter["description"]);
    texts_[name] = text;
    return;
  }
  const std::size_t count = parameter["numbers"];
  if (static_cast<std::size_t>(std::count(text.begin(), text.end(), ',')) + 1 != count)
    refuse(name, "is not " + std::to_string(count) + " numbers", parameter["description"]);
  std::vector<double>& numbers = numbers_[name];
  for (std::string_view rest = text; numbers.size() < count;) {
    const std::size_t length = std::min(rest.find(','), rest.size());
    numbers.push_back(number_in(name, parameter, rest.substr(0, length)));
    rest.remove_prefix(std::min(length + 1, rest.size()));
  }
}

std::string parameter_of(const Json& question, const std::string& option) {
  if (!option.starts_with("--")) return option;
  std::string base = option.substr(2, option.find(' ') - 2);
  std::replace(base.begin(), base.end(), '-', '_');
  for (const char* unit : {"", "_m", "_deg", "_s"})
    if (question["parameters"].contains(base + unit)) return base + unit;
  return option;
}

}  // namespace octosurf
