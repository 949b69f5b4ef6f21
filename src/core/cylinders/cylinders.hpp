#pragma once

#include "surfaces/ledger.hpp"

#include <vector>

namespace octosurf::cylinders {

using Patches = std::vector<std::vector<PointId>>;

/// Removes vanished and moved points from the cylinders they supported. O(delta).
void retract_cylinders(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta);

/// Updates the cylinders and searches for new ones in `points`, pending ones in key order.
///
/// 1. Known ones take points that fit, and grow from there through the octree.
/// 2. New ones come from patches rejected as curved, and from all connected points: thin rails are too curved
///    for a patch, and others are seen in several.
/// 3. Those that changed by an eighth are refitted; those no longer convincing are erased, and their points
///    stay pending. Those that have grown together are merged, the larger keeping its id.
/// Changes only cylinders, and nothing if there are no such points or changes.
void update_cylinders(surfaces::Ledger& ledger, std::vector<PointId> points, Patches curved);

}  // namespace octosurf::cylinders
