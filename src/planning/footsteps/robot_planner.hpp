#pragma once

#include "planning/footsteps/guide_map.hpp"
#include "planning/footsteps/walking_ground.hpp"

#include <map>
#include <memory>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// The common part of planners for all robots: the walking ground, the guide map, and timing.
class RobotPlanner {
 public:
  virtual ~RobotPlanner() = default;
  FootstepPlan plan(const Standing& from, const Standing& to, const PlanBudget& budget);

 protected:
  /// A robot's settings for these.
  struct Kind {
    ContactShape foot{};
    ContactLimits contact{};
    StepCosts costs{};
    BodyBox body{};
    int headings = 1;                             ///< FootholdField's
    double headroom_m = 0;                        ///< WalkingGround's
    double disc_radius_m = 0, trunk_reach_m = 0;  ///< GuideMap's
    GuideMap::Reach reach{};
  };
  RobotPlanner(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree, const Kind& kind,
               std::map<SurfaceId, std::vector<PolygonEdges>> edges);

  WalkingGround ground_;
  GuideMap guide_;

 private:
  /// Fills in a plan except its times; in the walking frame.
  virtual void search(const Standing& from, const Standing& to, const PlanBudget& budget,
                      FootstepPlan& plan) = 0;
  double prepare_ms() const { return ground_.prepare_ms() + guide_.build_ms(); }

  double told_ms_ = 0;  ///< of preparation, reported in plans so far
};

std::unique_ptr<RobotPlanner> make_biped_planner(std::shared_ptr<const Snapshot> snapshot,
                                                 OccupancyView octree, const Biped& robot,
                                                 std::map<SurfaceId, std::vector<PolygonEdges>> edges);
std::unique_ptr<RobotPlanner> make_quadruped_planner(std::shared_ptr<const Snapshot> snapshot,
                                                     OccupancyView octree, const Quadruped& robot,
                                                     std::map<SurfaceId, std::vector<PolygonEdges>> edges);

}  // namespace octosurf::footsteps
