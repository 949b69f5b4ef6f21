#pragma once

#include "footsteps/obstacle_columns.hpp"

#include <Eigen/Core>

#include <octosurf/contact.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// An intermediate pose of a foot or body: level position and heading, walking frame.
struct SwingPose {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
};

/// The box around a sole, and the leg on it.
struct LegBox {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< of the box, relative to the reference point
  double half_length = 0, half_width = 0;
  static LegBox of(const ContactShape& shape);
};

/// Whether the box `height` of a leg, moved straight and rotated evenly from one pose to the other between
/// `from_z` and `to_z`, is free of collisions.
bool sweep_free(ObstacleColumns& columns, const LegBox& leg, const SwingPose& from, const SwingPose& to,
                double from_z, double to_z);

/// sweep_free() at one of two heights over `ground`, up to the hip's.
struct Lift {
  double usual = 0, high = 0, hip = 0;
};
bool swing_free(ObstacleColumns& columns, const LegBox& leg, const SwingPose& from, const SwingPose& to,
                double ground, const Lift& lift);

/// Whether the body's box on its straight path between two poses over ground at these heights is free of
/// collisions; tilted with the ground.
bool body_sweep_free(ObstacleColumns& columns, const BodyBox& body, const SwingPose& from, double from_ground,
                     const SwingPose& to, double to_ground,
                     const Eigen::Vector2d& rise = Eigen::Vector2d::Zero());

/// The equivalent angle in [−π, π).
double turn_between(double from_rad, double to_rad);

}  // namespace octosurf::footsteps
