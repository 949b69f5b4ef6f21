#include "plan_query.hpp"

#include "geometry/degrees.hpp"
#include "planning/questions.hpp"

#include <numbers>
#include <variant>

#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>

namespace octosurf {
namespace {

double* field_of(const LimitOption& option, Robot& robot) {
  if (auto* biped = std::get_if<Biped>(&robot)) return option.biped ? option.biped(*biped) : nullptr;
  return option.quadruped ? option.quadruped(std::get<Quadruped>(robot)) : nullptr;
}

}  // namespace

const std::vector<LimitOption>& limit_options() {
  using B = Biped;
  using Q = Quadruped;
  static const std::vector<LimitOption> options{
      {"--max-forward", "longest step forward, m", 1, [](B& r) { return &r.max_forward_m; }, nullptr},
      {"--max-backward", "m, likewise", 1, [](B& r) { return &r.max_backward_m; }, nullptr},
      {"--min-width", "m, between the feet", 1, [](B& r) { return &r.min_width_m; }, nullptr},
      {"--max-width", "m, likewise", 1, [](B& r) { return &r.max_width_m; }, nullptr},
      {"--max-step", "m: a quadruped's body moves at most this far while each foot steps once", 1, nullptr,
       [](Q& r) { return &r.max_step_m; }},
      {"--reach", "m: a quadruped's foot steps at most this far from below its hip", 1, nullptr,
       [](Q& r) { return &r.reach_m; }},
      {"--max-up", "m, of a step", 1, [](B& r) { return &r.max_up_m; }, [](Q& r) { return &r.max_up_m; }},
      {"--max-down", "m, of a step", 1, [](B& r) { return &r.max_down_m; },
       [](Q& r) { return &r.max_down_m; }},
      {"--max-turn", "degrees a step", rad_per_deg, [](B& r) { return &r.max_turn_rad; },
       [](Q& r) { return &r.max_turn_rad; }},
      {"--max-slope", "degrees, of the ground", rad_per_deg, [](B& r) { return &r.contact.max_slope_rad; },
       [](Q& r) { return &r.contact.max_slope_rad; }},
      {"--edge-margin", "m, between soles and edges", 1, [](B& r) { return &r.contact.edge_margin_m; },
       [](Q& r) { return &r.contact.edge_margin_m; }},
      {"--frontier-margin", "m, between soles and edges beyond which nothing was observed", 1,
       [](B& r) { return &r.contact.frontier_margin_m; }, [](Q& r) { return &r.contact.frontier_margin_m; }},
      {"--lift", "m: height of a swinging foot", 1, [](B& r) { return &r.lift_m; },
       [](Q& r) { return &r.lift_m; }}};
  return options;
}

Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up) {
  Robot robot = query.robot == "biped" ? Robot(Biped{}) : Robot(Quadruped{});
  std::visit(
      [&](auto& kind) {
        kind.contact.up = up;
        if (!query.foot.empty()) kind.foot = planning::foot_of(query.foot);
      },
      robot);
  for (const auto& [name, value] : query.limits)
    for (const LimitOption& option : limit_options()) {
      if (name != option.name) continue;
      double* field = field_of(option, robot);
      if (field == nullptr)
        throw Error(Error::Kind::usage, name, "is none of a " + query.robot + "'s limits");
      *field = value * option.unit;
    }
  return robot;
}

Standing standing_of(const std::vector<double>& v) { return {{v[0], v[1], v[2]}, v[3] * rad_per_deg}; }

std::shared_ptr<const Snapshot> ground_for(const Snapshot& snapshot, const OccupancyView& octree,
                                           const Robot& robot) {
  return GroundView(std::make_shared<const Snapshot>(snapshot), octree,
                    GroundRules::of(robot, octree.resolution()))
      .solid();
}

bool needs_edge_kinds(const Robot& robot) {
  return std::visit([](const auto& kind) { return kind.contact.frontier_margin_m > 0; }, robot);
}

}  // namespace octosurf
