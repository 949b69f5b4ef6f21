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

/// The map as one robot walks on it: kept from plan to plan.
struct WalkingGround {
  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  std::map<SurfaceId, std::vector<PolygonEdges>> edges;
  ContactShape foot;
  ContactLimits contact;
  Eigen::Quaterniond R_walk_map;
  ObstacleColumns columns;
  FootholdField field;

  /// `headings` as FootholdField's; `headroom`: how far over the highest ground the robot reaches.
  WalkingGround(std::shared_ptr<const Snapshot> snapshot, OccupancyView octree,
                std::map<SurfaceId, std::vector<PolygonEdges>> edges, const ContactShape& foot,
                const ContactLimits& contact, const StepCosts& costs, int headings, double headroom);
  WalkingGround(const WalkingGround&) = delete;  // the field refers to its neighbours
  WalkingGround& operator=(const WalkingGround&) = delete;

  const std::vector<PolygonEdges>* edges_of(SurfaceId id) const;
  Footstep footstep(FootName foot_name, const Place& place, double yaw_rad) const;
  Standing to_map(Standing standing) const;
  Standing to_walk(Standing standing) const;
  double prepare_ms() const { return field.build_ms() + columns.load_ms(); }

  /// Ground within so many m of `at` (walking frame), nearest first: one place in each cell of the field.
  std::vector<Eigen::Vector3d> ground_near(const Eigen::Vector3d& at, int heading, double radius);

  /// Why a foot that is wanted at `at` (walking frame) does not stand there: the limit, and the end of a
  /// sentence.
  std::pair<std::optional<ContactRefusal>, std::string> why_not(const Eigen::Vector3d& at,
                                                                double yaw_rad) const;
};

/// Where a search that went nowhere came nearest to the goal (walking frame), and what stopped it there.
struct Frontier {
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  double nearest_m = 0;
  std::array<std::size_t, step_refusal_names.size()> refused{};
};

/// How a search ended without a plan.
enum class Ending {
  start_exhausted,  ///< all that can be reached was looked at
  goal_cut_off,     ///< all from which the goal can be reached was looked at
  budget
};
NoPlan refusal_of(const WalkingGround& ground, const Frontier& frontier, Ending ending,
                  std::size_t expansions);
/// "start: the left foot …", of the feet that do not stand; and where near `at` `stands` is true (walking
/// frame).
NoPlan refusal_of(WalkingGround& ground, NoPlan::Why why,
                  const std::vector<std::pair<FootName, Eigen::Vector3d>>& wanted, const Standing& at,
                  int heading, const std::function<bool(const Standing&)>& stands);

}  // namespace octosurf::footsteps
