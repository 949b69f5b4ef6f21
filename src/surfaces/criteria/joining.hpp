#pragma once

#include "surfaces/surface_model.hpp"

namespace octosurf::surfaces {

/// One plane explains both (one_plane in parts.hpp), and their normals are within 10°. `contact`: where
/// they meet, map frame.
bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const Eigen::Vector3d& contact,
              const sensing::NoiseModel& noise);

/// A joint plane fits both: it raises the rms distance of each by a third of s at most. Poses that drift
/// between visits leave the pieces of one surface that far apart. For surfaces that touch along most of the
/// smaller one's width.
bool joint_plane_fits(const SurfaceModel& a, const SurfaceModel& b, const sensing::NoiseModel& noise);

}  // namespace octosurf::surfaces
