#pragma once

#include "planning/footsteps/foothold_field.hpp"
#include "planning/footsteps/obstacle_columns.hpp"

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// The map prepared for one robot, reused between plans.
struct WalkingGround {
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  std::map<SurfaceId, std::vector<PolygonEdges>> edges;
  ContactShape foot;
  ContactLimits contact;
  Eigen::Quaterniond R_walk_map;
  ObstacleColumns columns;
  FootholdField field;

  /// `headings` as FootholdField's; `headroom`: the robot's height over the highest ground.
  WalkingGround(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree,
                std::map<SurfaceId, std::vector<PolygonEdges>> edges, const ContactShape& foot,
                const ContactLimits& contact, const StepCosts& costs, int headings, double headroom);
  WalkingGround(const WalkingGround&) = delete;  // the field refers to other members
  WalkingGround& operator=(const WalkingGround&) = delete;

  const std::vector<PolygonEdges>* edges_of(SurfaceId id) const;
  Footstep footstep(FootName foot_name, const Place& place, double yaw_rad) const;
  Standing to_map(Standing standing) const;
  Standing to_walk(Standing standing) const;
  double prepare_ms() const { return field.build_ms() + columns.load_ms(); }

  /// Ground within that many m of `at` (walking frame), nearest first: one place in each cell of the field.
  std::vector<Eigen::Vector3d> ground_near(const Eigen::Vector3d& at, int heading, double radius);

  /// Why a foot has no foothold at `at` (walking frame): the limit, and the end of a sentence.
  std::pair<std::optional<ContactRefusal>, std::string> why_not(const Eigen::Vector3d& at,
                                                                double yaw_rad) const;
};

/// The place nearest to the goal reached by a failed search (walking frame), and the obstacles there.
struct Frontier {
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  double nearest_m = 0;
  std::array<std::size_t, step_refusal_names.size()> refused{};
};

/// Result of a search without a plan.
enum class Ending {
  start_exhausted,  ///< all reachable nodes were expanded
  goal_cut_off,     ///< all nodes that can reach the goal were expanded
  budget
};
NoPlan refusal_of(const WalkingGround& ground, const Frontier& frontier, Ending ending,
                  std::size_t expansions);
/// "start: the left foot …", for the feet without foothold; also the nearest place to `at` where `stands` is
/// true (walking frame).
NoPlan refusal_of(WalkingGround& ground, NoPlan::Why why,
                  const std::vector<std::pair<FootName, Eigen::Vector3d>>& wanted, const Standing& at,
                  int heading, const std::function<bool(const Standing&)>& stands);

}  // namespace octosurf::footsteps
