#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Detector::due(): the pending points of blocks with enough new points since the last segmentation.
///
/// 1. Due are all pending points in the blocks of planelets, of each size, in which at least as many points
///    as a plane needs, and half of all waiting there, are new: with fewer, another segmentation would find
///    no plane either.
/// 2. The largest of those blocks form a queue, oldest first, from their first `fresh` point until they are
///    segmented. Of the block at which the budget ends, compact parts are due; it stays first. The budget is
///    DetectionParameters::detection_budget, or a quarter of the points waiting in these blocks.
/// 3. `expanded` points do not wait. But where the due points of a block contain a plane of their own, it may
///    extend into points assigned by expansion: all new points there are then due together, beyond the
///    budget, and are removed from `expanded`.
///
/// Cost: 20 ns for each point of the queue, and the segmented blocks.
Due due_to_segment(const surfaces::MapView& map, const surfaces::PendingQueue& queue,
                   std::span<const PointId> fresh, bool all, std::span<const Assignment> expanded);

/// Segmented points wait until their number has doubled, the growth that a plane needs to exceed clutter.
/// Planes rejected for their number alone need less: two in five of their points count as new, so they are
/// due after growing by a fifth.
std::vector<PointId> waiting_on(std::span<const PointId> too_few);

}  // namespace octosurf::detection
