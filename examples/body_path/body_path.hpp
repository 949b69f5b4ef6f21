#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <fcl/geometry/octree/octree.h>
#include <fcl/narrowphase/collision_object.h>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/height_grid.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::examples {

/// A trunk that legs carry over the ground; sizes of an ANYmal. Between its lower side and the ground is room
/// for what its legs step over.
struct Body {
  double length_m = 0.80, width_m = 0.45;
  double from_m = 0.25, to_m = 0.60;  ///< above the ground
  double max_rise_m = 0.22;           ///< between neighbouring points of the ground under it, 10 cm apart
  double max_slope_rad = 0.7;         ///< of the ground under it as a whole: stairs are 0.53
  double margin_m = 0.02;             ///< all round; a voxel's edge
};

/// Level position, and heading counter-clockwise from the map's x axis.
struct BodyState {
  double x = 0, y = 0, yaw_rad = 0;
};

struct BodyPath {
  std::vector<BodyState> states;           ///< at most 2 cm apart; empty: none was found
  std::vector<Eigen::Isometry3d> poses{};  ///< of them, laid on the ground, see BodyPlanner::pose()
  std::string refusal{};                   ///< why there is none
};

/// Plans where a robot's trunk goes, over one map whose z axis points up, with OMPL's RRT-Connect; FCL tells
/// whether the trunk touches an occupied voxel of the map. The legs come later: footsteps.hpp.
///
/// The ground is the highest surface at each place that is not steeper than 30°, so of storeys only the
/// uppermost is walked on; what nobody has seen is no ground.
class BodyPlanner {
 public:
  BodyPlanner(const Snapshot& snapshot, const OccupancyView& octree, const Body& body = {});

  /// The body's pose over the ground under it: origin on the plane that fits it best, z along that plane's
  /// normal. Nothing if a part of it has no ground under it, or one that its legs cannot follow.
  std::optional<Eigen::Isometry3d> pose(const BodyState& state) const;
  /// There is a pose, and nothing in the way.
  bool stands(const BodyState& state) const;

  /// Deterministic in `seed`: the search ends after `iterations`, not after a time. That none was found
  /// proves nothing, as with every planner that draws its samples.
  BodyPath plan(const BodyState& from, const BodyState& to, std::uint32_t seed = 1,
                unsigned iterations = 5000) const;

 private:
  std::optional<double> height(double x, double y) const;

  HeightGrid ground_;
  fcl::CollisionObjectd octree_;
  Body body_;
};

}  // namespace octosurf::examples
