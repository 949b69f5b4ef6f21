#pragma once

#include "geometry/voxel_key.hpp"

#include <vector>

namespace octosurf::surfaces {

/// Pending points added since the last detection around them, and the order of further detection.
struct PendingQueue {
  std::vector<geometry::VoxelKey> fresh;   ///< key order; some may no longer be pending
  std::vector<geometry::VoxelKey> blocks;  ///< oldest first: one voxel of each waiting block

  bool operator==(const PendingQueue&) const = default;
};

}  // namespace octosurf::surfaces
