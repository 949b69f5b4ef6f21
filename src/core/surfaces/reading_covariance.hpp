#pragma once

#include "surfaces/surface_model.hpp"

namespace octosurf::surfaces {

/// The plane's covariance from the scatter of its readings: Surface::covariance without the disagreement of
/// repeated observations. That has two causes that cannot be separated: inliers that lie too deep, and pose
/// drift. Alignment must not attribute drift to the plane, or it would correct less the more the poses drift;
/// the first cause, a tenth of a millimetre, is well below the common error of a scan's readings. O(1).
Eigen::Matrix3d covariance_of_readings(const SurfaceModel& surface, const sensing::NoiseModel& noise);

}  // namespace octosurf::surfaces
