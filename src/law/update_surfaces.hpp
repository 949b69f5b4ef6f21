#pragma once

#include "surfaces/ledger.hpp"

#include <span>

namespace octosurf::law {

/// The law's incremental form: around points that have changed it segments anew, beside what the surfaces
/// there have elsewhere, as sums. Pending points, and all those of surfaces that have changed by a quarter
/// since they were looked at as a whole, have no label at first; others keep theirs unless something explains
/// them better. `changed`: pending points that are new or seen better; `noise_factor2`: as for ReadingModel.
/// Cost follows the change: 10 µs for each point around it.
void update_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                     std::span<const geometry::VoxelKey> changed, double noise_factor2);

}  // namespace octosurf::law
