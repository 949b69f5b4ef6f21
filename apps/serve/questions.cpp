#include "serve/questions.hpp"

#include "plan_query.hpp"

#include <algorithm>

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

QuestionParameter place(const char* name, const char* description) {
  return {name, Kind::numbers, description, -far, far, 3, true};
}

QuestionParameter standing(const char* name, const char* description) {
  return {name, Kind::numbers, description, -far, far, 4, true};
}

QuestionParameter max_slope() {
  return {"max_slope_deg",
          Kind::number,
          "only surfaces that slope so much at most; 90 leaves out ceilings",
          0,
          180,
          1,
          false,
          180};
}

QuestionParameter foot(const char* otherwise) {
  QuestionParameter foot{"foot", Kind::text, "LENGTHxWIDTH of a sole, or the radius of a disc, m"};
  if (otherwise != nullptr) foot.otherwise = otherwise;
  return foot;
}

QuestionParameter margin(const char* name, const char* description) {
  return {name, Kind::number, description, 0, robot_size, 1, false, 0};
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
      standing("from", "x, y, z, m, on the ground between the feet, and the heading, degrees"),
      standing("to", "likewise"),
      {"robot", Kind::text, "biped or quadruped", 0, 0, 1, false, "biped", {"biped", "quadruped"}},
      foot(nullptr),
      {"budget", Kind::whole, "expansions to find a plan", 1, 100000, 1, false, budget.expansions},
      {"improving", Kind::whole, "further expansions to find a better one", 0, 100000, 1, false,
       budget.improving},
      {"time_s", Kind::number, "of search at most", 0, 30, 1, false, 10}};
  for (const LimitOption& option : limit_options()) {
    std::string name = option.name + 2;  // without its dashes
    std::replace(name.begin(), name.end(), '-', '_');
    const bool angle = option.unit != 1;
    parameters.push_back(
        {name + (angle ? "_deg" : "_m"), Kind::number, option.help, 0, angle ? 180 : robot_size});
  }
  return parameters;
}

// Schemas of the answers, as JSON; $ref to openapi.cpp's components.
constexpr std::string_view surfaces_answer =
    R"({"surfaces":{"type":"array","items":{"type":"integer"},"description":"ids, ascending"}})";
constexpr std::string_view ray_answer = R"({
  "surface":{"type":"integer","nullable":true,"description":"null: the ray meets none, and nothing else is given"},
  "point":{"$ref":"#/components/schemas/Point"},"distance_m":{"type":"number"},
  "side":{"type":"string","enum":["front","back"]}})";
constexpr std::string_view voxel_answer = R"({
  "state":{"type":"string","enum":["unknown","free","occupied"]},
  "log_odds":{"type":"number","nullable":true},"surface":{"type":"integer","nullable":true}})";
constexpr std::string_view nearest_answer = R"({
  "surface":{"type":"integer"},"point":{"$ref":"#/components/schemas/Point"},"distance_m":{"type":"number"},
  "normal":{"$ref":"#/components/schemas/Point"},"slope_deg":{"type":"number"},"area_m2":{"type":"number"}})";
constexpr std::string_view foothold_schema = R"({
  "surface":{"type":"integer"},"accepted":{"type":"boolean"},
  "refused":{"$ref":"#/components/schemas/Refusal"},
  "supported":{"type":"number","description":"share of the foot's area on the surface"},
  "margin_m":{"type":"number","description":"to the nearest edge; negative: how much too large the foot is"},
  "point":{"$ref":"#/components/schemas/Point"},"normal":{"$ref":"#/components/schemas/Point"},
  "heading":{"$ref":"#/components/schemas/Point"}})";
constexpr std::string_view region_schema = R"({
  "surface":{"type":"integer"},"revision":{"type":"integer"},
  "yaw_deg":{"type":"number","nullable":true,"description":"null: any heading"},
  "area_m2":{"type":"number"},
  "refused":{"type":"array","items":{"$ref":"#/components/schemas/Refusal"},
             "description":"if there is no polygon: why"},
  "polygons":{"type":"array","items":{"$ref":"#/components/schemas/Polygon"}},
  "pieces":{"type":"array","items":{"$ref":"#/components/schemas/Ring"}}})";
constexpr std::string_view regions_answer = R"({
  "revision":{"type":"integer"},
  "regions":{"type":"array","description":"one of each surface, as /api/regions gives them, without pieces",
    "items":{"type":"object"}}})";
constexpr std::string_view changes_answer = R"({
  "since":{"type":"integer"},"revision":{"type":"integer"},
  "appeared":{"type":"array","items":{"type":"integer"}},"changed":{"type":"array","items":{"type":"integer"}},
  "gone":{"type":"array","items":{"type":"integer"}},
  "merged":{"type":"array","items":{"type":"object","properties":{
    "id":{"type":"integer"},"into":{"type":"integer"}}}},
  "split":{"type":"array","items":{"type":"object","properties":{
    "id":{"type":"integer"},"part":{"type":"integer"}}}},
  "now":{"type":"object","description":"as /api/surfaces, of those that appeared or changed"}})";
constexpr std::string_view plan_answer = R"({
  "format":{"type":"string"},"version":{"type":"integer"},"found":{"type":"boolean"},
  "cost":{"type":"number"},"lower_bound":{"type":"number"},"expansions":{"type":"integer"},
  "prepare_ms":{"type":"number"},"search_ms":{"type":"number"},
  "start":{"type":"array","items":{"$ref":"#/components/schemas/Footstep"}},
  "steps":{"type":"array","items":{"$ref":"#/components/schemas/Footstep"}},
  "body":{"type":"array","items":{"type":"object","properties":{
    "at":{"$ref":"#/components/schemas/Point"},"yaw_deg":{"type":"number"}}}},
  "refusal":{"type":"object","description":"only if nothing was found: why","properties":{
    "why":{"type":"string","enum":["start","goal","unreachable","budget"]},"sentence":{"type":"string"}}}})";

std::vector<Question> make_questions() {
  const QuestionParameter yaw{"yaw_deg", Kind::number, "heading, degrees; any, if it is not given", -3600,
                              3600};
  QuestionParameter heading = yaw;
  heading.description = "heading, degrees";
  heading.required = true;
  const QuestionParameter id{"surface", Kind::whole, "its id", 1, last_id, 1, true};
  const QuestionParameter pieces{
      "pieces", Kind::whole, "at most so many convex pieces of it, too", 0, 200, 1, false, 0};
  return {
      {"/api/query/box",
       "ids of the surfaces in a box between two corners",
       {place("min", "a corner, m"), place("max", "the opposite one, m")},
       surfaces_answer},
      {"/api/query/sphere",
       "ids of the surfaces within a distance of a point",
       {place("center", "m"), {"radius_m", Kind::number, "m", 0, far, 1, true}},
       surfaces_answer},
      {"/api/query/ray",
       "the first surface along a ray",
       {place("from", "where it begins, m"), place("direction", "of any length")},
       ray_answer},
      {"/api/query/voxel",
       "the voxel that holds a point: its state, and whose it is",
       {place("point", "m")},
       voxel_answer},
      {"/api/query/nearest",
       "the place on a surface that is nearest to a point",
       {place("point", "m"), max_slope()},
       nearest_answer},
      {"/api/query/below",
       "the place on a surface that is met first straight below a point",
       {place("point", "m"), max_slope()},
       nearest_answer},
      {"/api/query/foothold",
       "what a foot would stand on, on the surface nearest to a point, or why it cannot",
       with_contact({place("point", "m"), heading}), foothold_schema},
      {"/api/regions", "where on a surface the middle of a foot may be, so that all of it is supported",
       with_contact({id, yaw, pieces}), region_schema},
      {"/api/regions/all", "likewise on every surface", with_contact({yaw}), regions_answer},
      {"/api/changes",
       "what became of the surfaces since a revision, and those that appeared or changed as they are now",
       {{"since", Kind::whole, "a revision that /api/info or an earlier answer told", 0, last_revision, 1,
         true}},
       changes_answer},
      {"/api/plan", "footsteps from one place to another, or why there are none", plan_parameters(),
       plan_answer},
  };
}

}  // namespace

const std::vector<Question>& questions() {
  static const std::vector<Question> all = make_questions();
  return all;
}

const Question& live_question() {
  static const Question live{
      "/live",
      "a WebSocket: what changes on the map, as it changes",
      {{"since", Kind::whole, "the revision that is known; everything, if it is not given", 0, last_revision},
       {"run", Kind::text,
        "whose revision that is, as messages told: everything, if the map is another run's"}},
      "{}"};
  return live;
}

const Question* find_question(std::string_view path) {
  const auto found = std::find_if(questions().begin(), questions().end(),
                                  [&](const Question& question) { return question.path == path; });
  return found == questions().end() ? nullptr : &*found;
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
