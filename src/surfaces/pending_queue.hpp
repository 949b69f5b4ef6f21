#pragma once

#include "geometry/voxel_key.hpp"

#include <vector>

namespace octosurf::surfaces {

/// Pending points that have come since surfaces were last looked for among them, and where to look next.
struct PendingQueue {
  std::vector<geometry::VoxelKey> fresh;   ///< key order; some may be pending no more
  std::vector<geometry::VoxelKey> blocks;  ///< oldest first: of each block that waits for its turn, a voxel

  bool operator==(const PendingQueue&) const = default;
};

}  // namespace octosurf::surfaces
