#include "planning/footsteps/robot_planner.hpp"

#include <cmath>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {
namespace {

void require_sensible(const Standing& standing, const char* name) {
  if (!standing.at.allFinite() || !std::isfinite(standing.yaw_rad))
    throw Error(Error::Kind::usage, name, "is not finite", "give X Y Z and a heading");
}

}  // namespace

struct FootstepPlanner::Impl {
  std::unique_ptr<footsteps::RobotPlanner> robot;
};

FootstepPlanner::FootstepPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, Robot robot,
                                 std::map<SurfaceId, std::vector<PolygonEdges>> edges)
    : impl_(std::make_unique<Impl>()) {
  std::visit([](const auto& kind) { kind.validate(); }, robot);
  if (const auto* biped = std::get_if<Biped>(&robot))
    impl_->robot =
        footsteps::make_biped_planner(std::move(snapshot), std::move(octree), *biped, std::move(edges));
  else
    impl_->robot = footsteps::make_quadruped_planner(std::move(snapshot), std::move(octree),
                                                     std::get<Quadruped>(robot), std::move(edges));
}

FootstepPlanner::FootstepPlanner(FootstepPlanner&&) noexcept = default;
FootstepPlanner& FootstepPlanner::operator=(FootstepPlanner&&) noexcept = default;
FootstepPlanner::~FootstepPlanner() = default;

FootstepPlan FootstepPlanner::plan(const Standing& from, const Standing& to, const PlanBudget& budget) {
  require_sensible(from, "from");
  require_sensible(to, "to");
  if (budget.time_s && !(*budget.time_s >= 0))
    throw Error(Error::Kind::usage, "time_s", "is not a time", "give seconds, or leave it empty");
  return impl_->robot->plan(from, to, budget);
}

}  // namespace octosurf
