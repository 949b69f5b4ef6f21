#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <octosurf/ids.hpp>

namespace octosurf {

/// A pillar, rail or rung: the observed part of a cylinder's lateral surface, seen from outside. Map frame,
/// metres. Immutable once published in a Snapshot.
///
/// Its inliers stay pending for plane detection: a surface may later claim a point, which then leaves the
/// cylinder. So cylinders never affect planes.
struct Cylinder {
  CylinderId id = 0;                                     ///< never reused
  Eigen::Vector3d axis_point = Eigen::Vector3d::Zero();  ///< on the axis, in the middle of the extent
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit; initially upward, or along +x or +y if level
  double radius_m = 0;                              ///< of the fitted cylinder
  double length_m = 0;  ///< extent of the inliers along the axis, centred at axis_point
  /// Unit, perpendicular to the axis: the inliers lie within `span_rad` from here, counter-clockwise seen
  /// from the axis' tip. The rest of the lateral surface has not been observed.
  Eigen::Vector3d start = Eigen::Vector3d::UnitX();
  double span_rad = 0;         ///< (0, 2π]
  std::size_t inliers = 0;     ///< voxels
  double rms_m = 0;            ///< of the inliers' distances to the lateral surface
  std::uint64_t born = 0;      ///< map revision in which it appeared
  std::uint64_t revision = 0;  ///< map revision of the last change
};

/// Keeps a cylinder of a snapshot alive.
using CylinderPtr = std::shared_ptr<const Cylinder>;

}  // namespace octosurf
