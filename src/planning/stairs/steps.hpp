#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include <octosurf/stairs.hpp>

namespace octosurf::planning {

/// m: codes hold the risers of a flight within 1 cm of each other; worn stairs, and planes seen from one
/// side, take the rest.
constexpr double riser_tolerance = 0.025;

/// A step with its edge in the map turned upright (z up).
struct UprightStep {
  Step step;
  /// Surfaces below and above: several where a worn or partly seen tread was mapped in parts. The step's own
  /// are those of the widest part.
  std::vector<SurfaceId> lower, upper;
  std::array<Eigen::Vector3d, 2> ends;                ///< left and right, of the edge
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();   ///< of the edge
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();  ///< unit vector, across the edge, upward
  bool adjoins = false;  ///< the lower surface is seen right before it, not only up to a foot away
};

/// Appends the ids that `ids` does not have yet.
void add_ids(const std::vector<SurfaceId>& added, std::vector<SurfaceId>& ids);

/// Every step of the snapshot's level surfaces, stair or not; by upper, then lower surface.
std::vector<UprightStep> find_steps(const Snapshot& snapshot, const Eigen::Vector3d& up);

}  // namespace octosurf::planning
