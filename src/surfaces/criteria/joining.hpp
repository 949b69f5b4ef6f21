#pragma once

#include "surfaces/surface_model.hpp"

namespace octosurf {

/// One plane explains both (one_plane in parts.hpp), and their normals are within 10°. `contact`: where
/// they meet, map frame.
bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const Eigen::Vector3d& contact,
              const NoiseModel& noise);

/// The same for surfaces that touch along most of the smaller one's width: a joint plane leaves each by a
/// third of s at most. Poses that drift between visits leave a surface's pieces that far apart.
bool grown_together(const SurfaceModel& a, const SurfaceModel& b, const NoiseModel& noise);

}  // namespace octosurf
