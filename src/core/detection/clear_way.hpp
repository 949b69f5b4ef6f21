#pragma once

#include "geometry/voxel_grid.hpp"

#include <Eigen/Core>

namespace octosurf::detection {

/// Whether no voxel on the straight way between two places of a plane, nor on the same way moved `above` it,
/// is blocked(VoxelKey): a reading there is of an object on the plane, such as a board, or of a wall. Looks
/// at each half voxel.
template <class Blocked>
bool is_clear_way(const geometry::VoxelGrid& grid, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                  const Eigen::Vector3d& above, Blocked&& blocked) {
  const int steps = static_cast<int>(2 * (to - from).norm() / grid.resolution());
  for (int k = 1; k < steps; ++k)
    for (const double lift : {0.0, 1.0}) {
      const Eigen::Vector3d at = from + (to - from) * (static_cast<double>(k) / steps) + lift * above;
      geometry::VoxelKey key;
      if (!grid.key_of(at.cast<float>(), key) || blocked(key)) return false;
    }
  return true;
}

}  // namespace octosurf::detection
