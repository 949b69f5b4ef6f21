#pragma once

#include "support/testing.hpp"

#include <octosurf/scan.hpp>

namespace octosurf::test {

/// A scan of a box-shaped room of half-size `half` around `centre`, from inside it, with noise:
/// rays in all directions, so that voxels of every orientation, seams and corners occur.
Scan room_scan(std::mt19937_64& rng, std::size_t rays, const Eigen::Vector3d& half,
               const Eigen::Vector3d& centre = Eigen::Vector3d::Zero(), double noise = 0.005);

/// Rays from one place into all directions, of lengths from `near` to `far`; along an axis or a diagonal now
/// and then: ties and zero components.
Scan rays_around(std::mt19937_64& rng, const Eigen::Vector3d& origin, std::size_t count, double near,
                 double far);

}  // namespace octosurf::test
