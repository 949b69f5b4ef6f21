#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// The pending points in cells (surfaces::Cells) of blocks with enough new cells since the last segmentation.
/// A cell is new if more than half of its pending points are.
///
/// 1. Due are all pending cells in the blocks of seed patches, of each size, in which at least a fifth of n,
///    the fewest points of a surface, and half of all waiting there are new: with fewer, another segmentation
///    would find no surface either, at any resolution.
/// 2. The largest of those blocks form a queue, oldest first, from their first `fresh` point until they are
///    segmented. DetectionParameters::detection_budget limits a scan to so many points, or to a quarter of
///    those waiting in these blocks; of the block at which it ends, compact parts are due, and it stays
///    first. Then, too, blocks in regions with surfaces have their `turn`, a number that counts up, in every
///    third scan, by address: more new points at a time cost less each. Without `turn` there is no limit.
///
/// Cost: 20 ns for each point of the queue, and the segmented blocks.
Due due_to_segment(const surfaces::MapView& voxels, const surfaces::PendingQueue& queue,
                   std::span<const PointId> fresh, std::optional<std::uint64_t> turn);

/// Segmented points wait until their number has doubled, the growth that a plane needs to exceed clutter.
/// Planes rejected for their number alone need less: two in five of their points count as new, so they are
/// due after growing by a fifth.
std::vector<PointId> waiting_on(std::span<const PointId> too_few);

}  // namespace octosurf::detection
