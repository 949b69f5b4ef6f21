#pragma once

#include "surfaces/ledger.hpp"

#include <set>
#include <span>
#include <vector>

namespace octosurf::law {

/// Gives pending points that a surface beside them explains to it, as relabel() would; the rest is returned.
/// What a scan sees anew of a surface that is there goes to it by this, point by point. Cost: 26 voxels for
/// each point.
std::vector<geometry::VoxelKey> take_in(surfaces::Ledger& ledger,
                                        std::span<const geometry::VoxelKey> pending);

/// Goes on from points that surfaces have got to the pending ones beside them that take_in() gives, and on
/// from those: what lies beyond all that was looked at together. The surfaces that got some, whose planes are
/// as they were. Cost: 26 voxels for each point that is given.
std::set<SurfaceId> grow_from(surfaces::Ledger& ledger, std::vector<geometry::VoxelKey> given);

/// Pending points that are worth segmenting now, and those that wait on.
struct Waiting {
  std::vector<geometry::VoxelKey> due;   ///< key order
  std::vector<geometry::VoxelKey> left;  ///< key order
};
/// All pending points in the blocks of planelets, of any of their sizes, in which as many have come as a
/// plane needs, and half of all that wait there: with fewer, what was no plane is not one now. Looks at
/// `before` only around `fresh`, where it forgets those that are pending no more; both in key order.
Waiting due_to_segment(const surfaces::MapView& map, std::vector<geometry::VoxelKey> before,
                       std::span<const geometry::VoxelKey> fresh);

/// What was segmented waits for as much again, which is how much a plane must grow to explain more than
/// clutter. What a plane was refused for its number alone has to grow less: of those points two in five wait
/// on, as if they had just come, so that they are due once a fifth more has.
std::vector<geometry::VoxelKey> waiting_on(std::span<const geometry::VoxelKey> too_few);

}  // namespace octosurf::law
