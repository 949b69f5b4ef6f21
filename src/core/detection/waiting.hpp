#pragma once

#include "surfaces/ledger.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Pending points to segment now, and the waiting rest.
struct Due {
  std::vector<PointId> points;  ///< key order
  surfaces::PendingQueue left;
  std::size_t waiting = 0;  ///< number of points of left.fresh in blocks of left.blocks
};

/// The pending points of blocks with enough new points since the last segmentation.
///
/// 1. Due are all pending points in the blocks of seed patches, of each size, in which at least a fifth of n,
///    the fewest points of a surface, and half of all waiting there are new: with fewer, another segmentation
///    would find no surface either, at any resolution.
/// 2. The largest of those blocks form a queue, oldest first, from their first `fresh` point until they are
///    segmented. Of the block at which the budget ends, compact parts are due; it stays first. The budget is
///    DetectionParameters::detection_budget, or a quarter of the points waiting in these blocks.
///
/// Cost: 20 ns for each point of the queue, and the segmented blocks.
Due due_to_segment(const surfaces::MapView& map, const surfaces::PendingQueue& queue,
                   std::span<const PointId> fresh, bool all);

/// Segmented points wait until their number has doubled, the growth that a plane needs to exceed clutter.
/// Planes rejected for their number alone need less: two in five of their points count as new, so they are
/// due after growing by a fifth.
std::vector<PointId> waiting_on(std::span<const PointId> too_few);

}  // namespace octosurf::detection
