#include "plan_query.hpp"

#include "geometry/degrees.hpp"
#include "planning/questions.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <variant>

#include <octosurf/error.hpp>

namespace octosurf {

const std::vector<RobotLimit>& robot_limits() {
  using B = Biped;
  using Q = Quadruped;
  static const std::vector<RobotLimit> limits{
      {"max_forward", "longest step forward, m", 1, [](B& r) { return &r.max_forward_m; }},
      {"max_backward", "m, likewise", 1, [](B& r) { return &r.max_backward_m; }},
      {"min_width", "m, between the feet", 1, [](B& r) { return &r.min_width_m; }},
      {"max_width", "m, likewise", 1, [](B& r) { return &r.max_width_m; }},
      {"max_step", "m: a quadruped's body moves at most this far while each foot steps once", 1,
       [](Q& r) { return &r.max_step_m; }},
      {"reach", "m: a quadruped's foot steps at most this far from below its hip", 1,
       [](Q& r) { return &r.reach_m; }},
      {"max_up", "m, of a step", 1, [](auto& r) { return &r.max_up_m; }},
      {"max_down", "m, of a step", 1, [](auto& r) { return &r.max_down_m; }},
      {"max_turn", "degrees a step", rad_per_deg, [](auto& r) { return &r.max_turn_rad; }},
      {"max_slope", "degrees, of the ground", rad_per_deg, [](auto& r) { return &r.contact.max_slope_rad; }},
      {"edge_margin", "m, between soles and edges", 1, [](auto& r) { return &r.contact.edge_margin_m; }},
      {"frontier_margin", "m, between soles and edges beyond which nothing was observed", 1,
       [](auto& r) { return &r.contact.frontier_margin_m; }},
      {"lift", "m: height of a swinging foot", 1, [](auto& r) { return &r.lift_m; }},
      {"high_lift", "m: likewise where it would touch something", 1, [](auto& r) { return &r.high_lift_m; }},
      {"stance_width", "m, between the feet when it stands", 1, [](auto& r) { return &r.stance_width_m; }},
      {"stance_length", "m, likewise between fore and hind feet", 1, [](Q& r) { return &r.stance_length_m; }},
      {"body_length", "m, of the trunk", 1, [](auto& r) { return &r.body.length_m; }},
      {"body_width", "m, likewise", 1, [](auto& r) { return &r.body.width_m; }},
      {"body_from", "m: height of its underside", 1, [](auto& r) { return &r.body.from_m; }},
      {"body_to", "m: height of its top", 1, [](auto& r) { return &r.body.to_m; }}};
  return limits;
}

std::string RobotLimit::field() const { return name + (unit != 1 ? std::string("_deg") : std::string("_m")); }

std::string name_of(const Robot& robot) {
  return std::holds_alternative<Biped>(robot) ? "biped" : "quadruped";
}

Robot robot_in(const std::string& name_or_file) {
  if (name_or_file == "biped") return Biped{};
  if (name_or_file == "quadruped") return Quadruped{};
  const std::string& file = name_or_file;
  std::ifstream in(file);
  if (!in)
    throw Error(Error::Kind::usage, "--robot " + file, "is no robot, and no file that can be read",
                "give biped, quadruped, or a JSON file");
  const auto json = nlohmann::json::parse(in, nullptr, false);
  const auto refuse = [&](const std::string& what, const std::string& hint = "") {
    throw Error(Error::Kind::data, file, what, hint);
  };
  if (!json.is_object() || !json.contains("robot") ||
      (json["robot"] != "biped" && json["robot"] != "quadruped"))
    refuse("is no robot", R"(write {"robot": "biped"} or "quadruped", and what differs from it)");
  Robot robot = robot_in(json["robot"]);
  for (const auto& [key, value] : json.items()) {
    if (key == "robot") continue;
    if (key == "foot") {
      if (!value.is_string()) refuse("has a foot that is no text", R"(write "0.22x0.11" or "0.03")");
      std::visit([&](auto& kind) { kind.foot = planning::foot_of(value); }, robot);
      continue;
    }
    const auto& all = robot_limits();
    const auto limit =
        std::find_if(all.begin(), all.end(), [&](const RobotLimit& l) { return l.field() == key; });
    double* const field = limit != all.end() ? limit->of(robot) : nullptr;
    if (field == nullptr) {
      std::string known = "foot";
      for (const RobotLimit& one : all)
        if (one.of(robot) != nullptr) known += ", " + one.field();
      refuse("has " + key + ", which is none of a " + name_of(robot) + "'s limits", "these are: " + known);
    }
    if (!value.is_number()) refuse("has no number for " + key);
    *field = value.get<double>() * limit->unit;
  }
  std::visit([](const auto& kind) { kind.validate(); }, robot);
  return robot;
}

Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up) {
  Robot robot = query.robot;
  std::visit(
      [&](auto& kind) {
        kind.contact.up = up;
        kind.foot = query.foot.value_or(kind.foot);
        if (query.unknown_is_free) kind.contact.unknown_to_m = 0;
      },
      robot);
  for (const auto& [limit, value] : query.limits) {
    double* const field = limit->of(robot);
    if (field == nullptr) {
      std::string option = limit->name;
      std::replace(option.begin(), option.end(), '_', '-');
      throw Error(Error::Kind::usage, "--" + option, "is none of a " + name_of(robot) + "'s limits");
    }
    *field = value;
  }
  return robot;
}

FootstepPlanner planner_on(const planning::AskedMap& map, const Robot& robot) {
  const auto ground = map.ground(GroundRules::of(robot, map.octree.resolution())).solid();
  std::map<SurfaceId, std::vector<PolygonEdges>> edges;
  if (std::visit([](const auto& kind) { return kind.contact.frontier_margin_m > 0; }, robot))
    for (const SurfacePtr& surface : ground->surfaces) edges[surface->id] = map.edges_of(*surface);
  return {ground, map.octree, robot, std::move(edges)};
}

}  // namespace octosurf
