#pragma once

#include "detection/patch.hpp"
#include "occupancy/occupancy_map.hpp"
#include "surfaces/surface_model.hpp"

namespace octosurf::detection {

/// All inliers of a surface as sums, weighted by how far each class of distance scatters about its plane.
/// How often they were hit is not known: once each. O(classes).
Patch patch_of(const surfaces::SurfaceModel& surface, const sensing::ReadingModel& model);

/// A surface's plane, and how sure its inliers are of it at a place.
class SurePlane {
 public:
  SurePlane(const Patch& patch, const sensing::ReadingModel& model);

  /// Nats for the least favourable of the planes within two standard deviations of the fit: a young plane
  /// does not extrapolate. Cost: a square root more than ReadingModel::log_ratio.
  double log_ratio(const occupancy::VoxelPoint& point) const;

 private:
  const sensing::ReadingModel* model_;
  Plane plane_;
  Eigen::Matrix3d R_;  // rows u, v, normal of a frame at `about_`
  Eigen::Vector3d about_;
  Eigen::Matrix3d covariance_;  // of offset and slopes there, without what all readings share
};

}  // namespace octosurf::detection
