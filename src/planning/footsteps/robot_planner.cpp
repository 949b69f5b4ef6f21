#include "planning/footsteps/robot_planner.hpp"

#include <chrono>
#include <utility>

namespace octosurf::footsteps {

RobotPlanner::RobotPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Kind& kind,
                           std::map<SurfaceId, std::vector<PolygonEdges>> edges)
    : ground_(std::move(snapshot), std::move(octree), std::move(edges), kind.foot, kind.contact, kind.costs,
              kind.headings, kind.headroom_m),
      guide_(ground_.field, kind.disc_radius_m, kind.contact, ground_.edges, kind.reach, kind.body,
             kind.trunk_reach_m, ground_.columns) {}

FootstepPlan RobotPlanner::plan(const Standing& from, const Standing& to, const PlanBudget& budget) {
  const auto start = std::chrono::steady_clock::now();
  const double prepared = prepare_ms();
  FootstepPlan plan;
  search(ground_.to_walk(from), ground_.to_walk(to), budget, plan);
  const double ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  plan.prepare_ms = prepare_ms() - std::exchange(told_ms_, prepare_ms());
  plan.search_ms = ms - (prepare_ms() - prepared);
  return plan;
}

}  // namespace octosurf::footsteps
