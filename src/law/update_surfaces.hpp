#pragma once

#include "surfaces/ledger.hpp"

#include <set>
#include <span>
#include <vector>

namespace octosurf::law {

/// The law's incremental form, in the order of a scan's way (docs/design.md §4): take_in() and
/// due_to_segment() (waiting.hpp), detect(), grow_from(), revise(). Cost follows the change: some 10 µs for
/// each point labelled anew.

struct Detected {
  std::vector<geometry::VoxelKey> given;    ///< pending points that have a surface now
  std::vector<geometry::VoxelKey> too_few;  ///< those of planes that were refused for their number alone
};
/// Segments anew around `due`, beside what the surfaces there have elsewhere, as sums. Pending points have no
/// label at first; inliers keep theirs unless something explains them better. `due`: pending points, in
/// order.
Detected detect(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                std::span<const geometry::VoxelKey> due);

/// Looks at surfaces that have doubled since they were looked at as wholes: their points begin without a
/// label. Then fits the planes of `grown`, and of all others that this scan touched and that were not fitted
/// anew.
void revise(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree, std::set<SurfaceId> grown);

}  // namespace octosurf::law
