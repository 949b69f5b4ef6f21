#pragma once

#include "occupancy/point_window.hpp"
#include "sensing/noise_model.hpp"
#include "surfaces/surface_store.hpp"

#include <vector>

namespace octosurf::surfaces {

/// Local plane at a point.
struct LocalPlane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, toward where the point was seen from
  float curvature = 1;                               ///< surface variation λ₀/Σλ
  int reach = 0;                                     ///< voxels, the neighbourhood it took
  bool known = false;                                ///< false: fewer than three neighbours, or all in a line
  bool flat = false;                                 ///< its curvature may be noise on a plane
};

/// Normals of a window's points by moving least squares of degree 1 (paper III-C2; Alexa et al.
/// 2003): a plane through the neighbours, weighted by exp(−distance²/radius²). Computed when first
/// asked for. The measured points are kept, not moved.
///
/// The radius is `normal_radius`; where that many points are too few or in a line (laser strips), or
/// too noisy for it, it is widened up to r. Neighbours that were seen from the opposite side do not
/// count, so the two sides of a thin wall stay apart. Nor do points of a surface whose plane the
/// point in question lies off, so that the edge beside a known table top is not rounded. All other points
/// count, those of surfaces too.
class NormalField {
 public:
  NormalField(const occupancy::PointWindow& window, const Parameters& parameters,
              const sensing::NoiseModel& noise, const SurfaceStore& surfaces);

  /// The reference stays good while other points are asked for.
  const LocalPlane& at(occupancy::PointWindow::Index i) const {
    return i < done_.size() && done_[i] ? planes_[i] : computed(i);
  }

 private:
  const LocalPlane& computed(occupancy::PointWindow::Index i) const;
  LocalPlane compute(occupancy::PointWindow::Index i, double radius) const;
  bool lies_off(const occupancy::VoxelPoint& p, SurfaceId surface) const;

  const occupancy::PointWindow& window_;
  const sensing::NoiseModel& noise_;
  const SurfaceStore& surfaces_;
  double resolution_, smallest_, largest_, max_curvature_;
  mutable occupancy::PagedVector<LocalPlane> planes_;  // of those asked for so far
  mutable std::vector<bool> done_;
};

}  // namespace octosurf::surfaces
