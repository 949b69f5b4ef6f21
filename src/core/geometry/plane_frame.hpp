#pragma once

#include "geometry/moments.hpp"

#include <Eigen/Core>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// A frame whose z is `normal` (unit), with x horizontal, also for exactly level or upright planes.
Eigen::Matrix3d plane_axes(const Eigen::Vector3d& normal);

/// Plane through the points of moments about `reference`; normal on the side of `toward`.
Plane fitted_plane(const Moments& moments, const Eigen::Vector3d& reference, const Eigen::Vector3d& toward);
/// Width of the narrow side, m: a uniform strip of width w has a variance of w²/12 across.
double width_of(const Moments& moments);

}  // namespace octosurf::geometry
