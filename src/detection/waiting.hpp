#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Detector::due(): all pending points in the blocks of planelets, of any of their sizes, in which as many
/// have come as a plane needs, and half of all that wait there: with fewer, what was no plane is not one now.
/// Looks at `before` only around `fresh`, where it forgets those that are pending no more; both in key order.
///
/// `expanded`: what surfaces are to gain, which does not wait. But where what is due in a block holds a plane
/// of its own, that may reach into what seems to be the surface's: all that is new there is due together, and
/// is taken out of `expanded`.
Waiting due_to_segment(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                       std::vector<geometry::VoxelKey> before, std::span<const geometry::VoxelKey> fresh,
                       std::vector<Assignment>& expanded);

/// What was segmented waits for as much again, which is how much a plane must grow to explain more than
/// clutter. What a plane was refused for its number alone has to grow less: of those points two in five wait
/// on, as if they had just come, so that they are due once a fifth more has.
std::vector<geometry::VoxelKey> waiting_on(std::span<const geometry::VoxelKey> too_few);

}  // namespace octosurf::detection
