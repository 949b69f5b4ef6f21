#pragma once

#include "surfaces/ledger.hpp"

#include <set>
#include <span>
#include <vector>

namespace octosurf::detection {

/// Detection's incremental form, in the order of a scan's way (docs/design.md §4): add_inliers() and expand()
/// (expand.hpp), due_to_segment() (waiting.hpp), detect(), expand() again, revise(). Cost follows the change:
/// some 10 µs for each point labelled anew.

struct Detected {
  std::vector<geometry::VoxelKey> assigned;  ///< pending points that have a surface now
  std::vector<geometry::VoxelKey> too_few;   ///< those of planes that were refused for their number alone
};
/// Segments the rest (paper, III-C): `due`, pending points in order, and `touching` inliers with it,
/// where two surfaces may be one. Surfaces around take part as sums, and are met across gaps up to h; see
/// neighbourhood_of().
Detected detect(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                std::span<const geometry::VoxelKey> due, std::span<const geometry::VoxelKey> touching);

/// Looks at surfaces that have doubled since they were looked at as wholes: their points begin without a
/// label. Then fits the planes of `grown`, and of all others that this scan touched and that were not fitted
/// anew.
void revise(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree, std::set<SurfaceId> grown);

}  // namespace octosurf::detection
