#pragma once

#include "detection/patch.hpp"
#include "occupancy/occupancy_map.hpp"
#include "surfaces/surface_model.hpp"

#include <array>

namespace octosurf::detection {

using ClassCosines = std::array<double, sensing::NoiseModel::classes>;
using ClassMoments = std::array<geometry::Moments, sensing::NoiseModel::classes>;

/// Sums over a surface's inliers, but for some: `without`, their moments about the surface's reference, by
/// range class. Weighted by the scatter of each class about the plane, as seen at cosines of at least
/// `least`: those that scatter more were seen more head-on. Hit counts are unknown: one each. As if there
/// were so many `times` as many. O(classes).
Patch patch_of(const surfaces::SurfaceModel& surface, const sensing::ReadingModel& model,
               const ClassMoments& without = {}, const ClassCosines& least = {}, double times = 1);

/// A surface's plane with the covariance of its heights.
class SurePlane {
 public:
  SurePlane(const Patch& patch, const sensing::ReadingModel& model);

  /// Nats for the least favourable of the planes within two standard deviations of the fit: a plane with few
  /// inliers does not extrapolate. Cost: a square root more than ReadingModel::log_ratio.
  double log_ratio(const occupancy::VoxelPoint& point) const;
  /// Whether that is positive.
  bool fits(const occupancy::VoxelPoint& point) const {
    return !model_->out_of_reach(plane_.signed_distance(point.position.cast<double>()), point.range_class) &&
           log_ratio(point) > 0;
  }

 private:
  const sensing::ReadingModel* model_;
  Plane plane_;
  Eigen::Matrix3d R_;  // rows u, v, normal of a frame at `about_`
  Eigen::Vector3d about_;
  Eigen::Matrix3d covariance_;  // of offset and slopes there, without the readings' common error
};

}  // namespace octosurf::detection
