#pragma once

#include "surfaces/ledger.hpp"

#include <span>
#include <vector>

namespace octosurf::cylinders {

using Patches = std::vector<std::vector<PointId>>;

/// Removes vanished and moved points from the cylinders they supported. O(delta).
void retract_cylinders(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta);

/// Updates the cylinders by `points`, pending ones in key order, and begins new ones in `bent` patches: those
/// rejected as curved, and those too narrow for a surface.
///
/// 1. Known ones take points that belong to them, and grow from there through the octree.
/// 2. A patch, or else each half of the rest of it, gives a first shape by its curvature, which grows through
///    the octree, is fitted to the points it reached, and is kept if convincing.
/// 3. Those that changed by an eighth are refitted; those no longer convincing are erased, and their points
///    stay pending. Those that one shape explains are merged, the larger keeping its id.
/// Changes only cylinders, and nothing if there are no such points or changes.
void update_cylinders(surfaces::Ledger& ledger, std::span<const PointId> points, Patches bent);

}  // namespace octosurf::cylinders
