#pragma once

#include "surfaces/surface_model.hpp"

namespace octosurf::surfaces {

/// How sure the scatter of its readings leaves a surface's plane: Surface::covariance without what repeated
/// observations say otherwise than the first ones. That difference has two causes, which it does not tell
/// apart: inliers that lie too deep, and poses that slid meanwhile. Who measures poses by the plane must not
/// hold the second for the plane's own error, or would follow drift the less the more there is of it; the
/// first, a tenth of a millimetre, is well below what a scan's readings of a surface have in common. O(1).
Eigen::Matrix3d covariance_of_readings(const SurfaceModel& surface, const sensing::NoiseModel& noise);

}  // namespace octosurf::surfaces
