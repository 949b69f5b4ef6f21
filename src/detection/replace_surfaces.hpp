#pragma once

#include "surfaces/ledger.hpp"

namespace octosurf::detection {

/// The map's surfaces are from now on those that segment() finds among all of the octree's points, owned and
/// pending (write_surfaces()). No point waits for detection then.
void replace_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree);

}  // namespace octosurf::detection
