#include "plan_query.hpp"

#include "geometry/degrees.hpp"
#include "planning/questions.hpp"

#include <algorithm>
#include <variant>

#include <octosurf/error.hpp>

namespace octosurf {

const std::vector<RobotLimit>& robot_limits() {
  using B = Biped;
  using Q = Quadruped;
  static const std::vector<RobotLimit> limits{
      {"max_forward", "longest step forward, m", 1, [](B& r) { return &r.max_forward_m; }, nullptr},
      {"max_backward", "m, likewise", 1, [](B& r) { return &r.max_backward_m; }, nullptr},
      {"min_width", "m, between the feet", 1, [](B& r) { return &r.min_width_m; }, nullptr},
      {"max_width", "m, likewise", 1, [](B& r) { return &r.max_width_m; }, nullptr},
      {"max_step", "m: a quadruped's body moves at most this far while each foot steps once", 1, nullptr,
       [](Q& r) { return &r.max_step_m; }},
      {"reach", "m: a quadruped's foot steps at most this far from below its hip", 1, nullptr,
       [](Q& r) { return &r.reach_m; }},
      {"max_up", "m, of a step", 1, [](B& r) { return &r.max_up_m; }, [](Q& r) { return &r.max_up_m; }},
      {"max_down", "m, of a step", 1, [](B& r) { return &r.max_down_m; }, [](Q& r) { return &r.max_down_m; }},
      {"max_turn", "degrees a step", rad_per_deg, [](B& r) { return &r.max_turn_rad; },
       [](Q& r) { return &r.max_turn_rad; }},
      {"max_slope", "degrees, of the ground", rad_per_deg, [](B& r) { return &r.contact.max_slope_rad; },
       [](Q& r) { return &r.contact.max_slope_rad; }},
      {"edge_margin", "m, between soles and edges", 1, [](B& r) { return &r.contact.edge_margin_m; },
       [](Q& r) { return &r.contact.edge_margin_m; }},
      {"frontier_margin", "m, between soles and edges beyond which nothing was observed", 1,
       [](B& r) { return &r.contact.frontier_margin_m; }, [](Q& r) { return &r.contact.frontier_margin_m; }},
      {"lift", "m: height of a swinging foot", 1, [](B& r) { return &r.lift_m; },
       [](Q& r) { return &r.lift_m; }}};
  return limits;
}

Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up) {
  Robot robot = query.robot == "biped" ? Robot(Biped{}) : Robot(Quadruped{});
  std::visit(
      [&](auto& kind) {
        kind.contact.up = up;
        kind.foot = query.foot.value_or(kind.foot);
      },
      robot);
  for (const auto& [limit, value] : query.limits) {
    double* field = nullptr;
    if (auto* biped = std::get_if<Biped>(&robot))
      field = limit->biped ? limit->biped(*biped) : nullptr;
    else
      field = limit->quadruped ? limit->quadruped(std::get<Quadruped>(robot)) : nullptr;
    if (field == nullptr) {
      std::string option = limit->name;
      std::replace(option.begin(), option.end(), '_', '-');
      throw Error(Error::Kind::usage, "--" + option, "is none of a " + query.robot + "'s limits");
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
