#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Detector::due(): the pending points of blocks in which enough has come since they were last looked at.
///
/// 1. Due are all pending points in the blocks of planelets, of any of their sizes, in which as many have
///    come as a plane needs, and half of all that wait there: with fewer, what was no plane is not one now.
/// 2. The largest of those blocks take turns, the oldest first, from when something `fresh` comes to them
///    until they have been looked at. Of the one at which the budget ends, compact parts are due; it stays
///    first. The budget is DetectionParameters::detection_budget, or a quarter of what waits in these blocks.
/// 3. `expanded`: what surfaces are to gain, which does not wait. But where what is due in a block holds a
///    plane of its own, that may reach into what seems to be the surface's: all that is new there is due
///    together, beyond the budget, and is taken out of `expanded`.
///
/// Cost: 20 ns for each point of `before`, and the blocks that are looked at.
Due due_to_segment(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                   surfaces::PendingQueue before, std::span<const geometry::VoxelKey> fresh, bool all,
                   std::vector<Assignment>& expanded);

/// What was segmented waits for as much again, which is how much a plane must grow to explain more than
/// clutter. What a plane was refused for its number alone has to grow less: of those points two in five wait
/// on, as if they had just come, so that they are due once a fifth more has.
std::vector<geometry::VoxelKey> waiting_on(std::span<const geometry::VoxelKey> too_few);

}  // namespace octosurf::detection
