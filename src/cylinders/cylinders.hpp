#pragma once

#include "cylinders/left_over.hpp"
#include "surfaces/ledger.hpp"

namespace octosurf::cylinders {

/// Takes vanished and moved points out of the cylinders they supported. O(delta).
void retract_cylinders(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta);

/// Keeps the cylinders up to date and looks for new ones among what planes have left over.
///
/// 1. Known ones take those that fit, and grow outward from there through the octree.
/// 2. New ones come from what is left of smooth regions, and of points in no region (thin rails bend too
///    much for one) that lie together.
/// 3. Those that changed by an eighth are fitted again; those that are not convincing any more are erased,
///    and their points stay pending. Those that have grown into one are merged, the larger keeping its id.
/// Changes nothing but the cylinders, and nothing at all if nothing was left over or taken.
void update_cylinders(surfaces::Ledger& ledger, const LeftOver& left_over);

}  // namespace octosurf::cylinders
