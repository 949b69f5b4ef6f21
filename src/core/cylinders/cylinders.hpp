#pragma once

#include "cylinders/left_over.hpp"
#include "surfaces/ledger.hpp"

namespace octosurf::cylinders {

/// Removes vanished and moved points from the cylinders they supported. O(delta).
void retract_cylinders(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta);

/// Updates the cylinders and searches for new ones in points without a plane.
///
/// 1. Known ones take points that fit, and grow from there through the octree.
/// 2. New ones come from the remaining points of smooth regions, and from connected points in no region (thin
///    rails are too curved for one).
/// 3. Those that changed by an eighth are refitted; those no longer convincing are erased, and their points
///    stay pending. Those that have grown together are merged, the larger keeping its id.
/// Changes only cylinders, and nothing if there are no such points or changes.
void update_cylinders(surfaces::Ledger& ledger, const LeftOver& left_over);

}  // namespace octosurf::cylinders
