#pragma once

#include "sensing/downsample.hpp"
#include "surfaces/ledger.hpp"

#include <span>

namespace octosurf::update {

/// Removes vanished voxels from their surfaces, updates refined points (those that no longer fit become
/// pending), and dissolves surfaces that fell below n. Cost follows the delta.
void retract(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta);

/// Adds repeated observations of inlier voxels to each surface's moments. Counts points, but at most eight in
/// a voxel, because a sensor's neighbouring readings have common errors. A surface with new evidence only is
/// not refitted until another change.
void observe_again(surfaces::Ledger& ledger, const sensing::VoxelScan& scan,
                   std::span<const occupancy::OccupancyDelta::Confirmed> confirmed);

}  // namespace octosurf::update
