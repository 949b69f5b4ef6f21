#pragma once

#include "surfaces/map_view.hpp"

namespace octosurf::surfaces {

/// Something stands on the plane between two of its points: there is a point that is not the plane's noise on
/// the straight way from `a` to `b`, in the first of `layers` of voxels above the `reach` of the noise. More
/// than one layer is for sparse readings, where a board may have no point in the lowest.
bool obstructed(const MapView& map, const Plane& plane, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                double reach, int layers = 1);

}  // namespace octosurf::surfaces
