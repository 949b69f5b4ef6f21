#pragma once

#include "surfaces/scan_changes.hpp"

namespace octosurf {

/// Something stands on the plane between two points of it: a point that is not its noise, on the way
/// from `a` to `b` just above the `reach` of the noise, or in as many `layers` of voxels above that, where
/// so few readings are that a board may have none in the lowest.
bool obstructed(Workspace& work, const Plane& plane, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                double reach, int layers = 1);

}  // namespace octosurf
