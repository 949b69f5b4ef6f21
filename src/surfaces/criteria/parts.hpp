#pragma once

#include "surfaces/map_view.hpp"

#include <span>
#include <vector>

namespace octosurf::surfaces {

/// Points that may be one plane, in the form that planes are compared in.
struct Patch {
  geometry::Moments moments;  ///< weighted by 1/σ², relative to the nearest class, about `reference`
  Eigen::Vector3d reference = Eigen::Vector3d::Zero();
  double points = 0;
};

/// One plane explains both: at `contact`, where they meet, their heights over `about` and their slopes differ
/// by no more than the covariance of the fits explains (Mahalanobis distance, 99.9 %), enlarged by the errors
/// that edges and far views leave in a fit: a tenth of `tolerance` (s, m) and 0.4°.
bool one_plane(const Patch& a, const Patch& b, const Plane& about, const Eigen::Vector3d& contact,
               double tolerance, double resolution);

/// Divides the points of a plane into its connected parts. Cells of the plane that touch belong
/// together; across a gap of up to h they do if one plane explains both sides and nothing stands in
/// the gap: two blocks side by side are tilted a little differently, and a shelf's board divides the wall
/// behind it. Cost O(n log n).
std::vector<std::vector<MapView::Index>> parts_of(const MapView& map, std::span<const MapView::Index> points,
                                                  const Plane& plane);

}  // namespace octosurf::surfaces
