#pragma once

#include <Eigen/Geometry>

namespace octosurf {

/// A box, or a cylinder about its own z axis.
struct SpacePart {
  Eigen::Isometry3d T_map_part = Eigen::Isometry3d::Identity();  ///< its middle
  /// m: to the faces along its axes; of a cylinder radius, radius and half the height.
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();
  bool round = false;  ///< a cylinder

  static SpacePart box(const Eigen::AlignedBox3d& box);  ///< along the map's axes
  /// Along `axis`, a unit vector, from the middle of its base.
  static SpacePart cylinder(const Eigen::Vector3d& base, double radius, double height,
                            const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ());

  /// m, of a point outside, at most as far as it is; negative inside: of the nearest face.
  double distance(const Eigen::Vector3d& point) const;
};

}  // namespace octosurf
