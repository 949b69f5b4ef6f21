#pragma once

#include "support/scene.hpp"

#include <octosurf/alignment.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::test {

/// A finished map whose surfaces are a scene's rectangles, exactly: each seen from the side that `inside`
/// lies on.
std::shared_ptr<const Snapshot> map_of_rectangles(const Scene& scene, const Eigen::Vector3d& inside,
                                                  double resolution = 0.02);

/// A room of 4 × 5 × 2.5 m about (2, 2.5, 1.2) with a table and a cupboard in it.
Scene furnished_room();
inline const Eigen::Vector3d middle_of_room(2, 2.5, 1.2);

/// A direction, evenly drawn.
Eigen::Vector3d any_direction(std::mt19937_64& rng);
/// A motion by so much, in any direction about any axis.
Twist any_twist(std::mt19937_64& rng, double translation_m, double rotation_rad);

}  // namespace octosurf::test
