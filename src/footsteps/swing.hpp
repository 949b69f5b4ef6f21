#pragma once

#include "footsteps/obstacle_columns.hpp"
#include "planning/unknown_space.hpp"

#include <Eigen/Core>
#include <utility>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// An intermediate pose of a foot or body: level position and heading, walking frame.
struct SwingPose {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
};

/// A box that moves with a pose: around a sole and the leg on it, or the body's.
struct LegBox {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< of the box, relative to the reference point
  double half_length = 0, half_width = 0;
  static LegBox of(const ContactShape& shape);
};

/// Whether the box, moved straight and rotated evenly from one pose to the other, is free of collisions
/// between `from_z` and `to_z`; these rise by `climb` on the way, and everywhere with the ground's `rise`.
bool sweep_free(ObstacleColumns& columns, const LegBox& box, const SwingPose& from, const SwingPose& to,
                double from_z, double to_z, double climb = 0,
                const Eigen::Vector2d& rise = Eigen::Vector2d::Zero());

/// Unknown space in the walking frame (planning/unknown_space.hpp).
class UnknownSpace {
 public:
  UnknownSpace(OccupancyView octree, const Eigen::Matrix3d& R_walk_map)
      : voxels_(std::move(octree)), R_walk_map_(R_walk_map) {}
  /// Whether a moving box (sweep_free()) would meet some; voxels count by their middles.
  bool met(const LegBox& box, const SwingPose& from, const SwingPose& to, double from_z, double to_z);

 private:
  planning::UnknownVoxels voxels_;
  Eigen::Matrix3d R_walk_map_;
};

/// sweep_free() of the body between poses over ground at these heights; tilted with the ground.
inline bool body_sweep_free(ObstacleColumns& columns, const BodyBox& body, const SwingPose& from,
                            double from_ground, const SwingPose& to, double to_ground,
                            const Eigen::Vector2d& rise = Eigen::Vector2d::Zero()) {
  return sweep_free(columns, {{0, 0}, body.length_m / 2, body.width_m / 2}, from, to,
                    from_ground + body.from_m, from_ground + body.to_m, to_ground - from_ground, rise);
}

/// The equivalent angle in [−π, π).
double turn_between(double from_rad, double to_rad);

}  // namespace octosurf::footsteps
