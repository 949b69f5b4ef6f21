#pragma once

#include "occupancy/paged_vector.hpp"
#include "sensing/reading_model.hpp"
#include "surfaces/map_view.hpp"

#include <vector>

namespace octosurf::cylinders {

/// Local plane at a point.
struct LocalPlane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, toward the sensor
  bool known = false;                                ///< false: too few neighbours, or collinear
};

/// Normals of a window's points by moving least squares of degree 1 (paper III-C2; Alexa et al. 2003): a
/// plane through the neighbours, weighted by exp(−distance²/radius²). Computed on first access. Points are
/// not moved.
///
/// The radius is `normal_radius`, widened up to r where there are too few points, or collinear (laser strips)
/// or too noisy ones. Neighbours seen from the opposite side do not count, which separates the two sides of a
/// thin wall. Nor do points of a surface if the query point is off its plane, so that the edge beside a known
/// table top is not rounded. All other points count, including those of surfaces.
class NormalField {
 public:
  explicit NormalField(const surfaces::MapView& map);

  /// The reference stays valid during further accesses.
  const LocalPlane& at(PointId point) const {
    const std::size_t i = index_of(point);
    return i < done_.size() && done_[i] ? planes_[i] : computed(point);
  }

 private:
  const LocalPlane& computed(PointId point) const;
  LocalPlane compute(PointId i, double radius) const;
  bool lies_off(const occupancy::VoxelPoint& p, SurfaceId surface) const;

  const surfaces::MapView& map_;
  sensing::ReadingModel model_;
  double resolution_, smallest_, largest_;
  mutable occupancy::PagedVector<LocalPlane> planes_;  // of points accessed so far
  mutable std::vector<bool> done_;
};

}  // namespace octosurf::cylinders
