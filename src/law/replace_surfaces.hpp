#pragma once

#include "surfaces/ledger.hpp"

namespace octosurf::law {

/// The map's surfaces are from now on those that segment() finds among all of the octree's points, owned and
/// pending (write_surfaces()). No point waits for detection then. `noise_factor2`: as for ReadingModel.
void replace_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree, double noise_factor2);

}  // namespace octosurf::law
