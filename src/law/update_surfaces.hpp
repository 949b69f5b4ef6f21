#pragma once

#include "surfaces/ledger.hpp"

#include <span>
#include <vector>

namespace octosurf::law {

/// What the law has left pending.
struct LeftPending {
  std::vector<geometry::VoxelKey> waiting;  ///< not worth segmenting yet, or without their surface since
  std::vector<geometry::VoxelKey> refused;  ///< segmented, and no surface's
};

/// The law's incremental form. What a surface beside it explains goes to that one; around the rest, where
/// enough has come to be worth it, it segments anew, beside what the surfaces there have elsewhere, as sums.
/// Pending points have no label at first, nor have those of surfaces that have doubled since they were looked
/// at as wholes; others keep theirs unless something explains them better.
///
/// `fresh`: pending points that are new or seen better; `waiting`: what the last call left so. All keys are
/// in order. Cost follows the change: some 10 µs for each point
/// labelled anew.
LeftPending update_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                            std::vector<geometry::VoxelKey> waiting,
                            std::span<const geometry::VoxelKey> fresh);

}  // namespace octosurf::law
