#pragma once

#include "sensing/downsample.hpp"
#include "surfaces/ledger.hpp"

#include <span>

namespace octosurf::upkeep {

/// Takes vanished voxels out of their surfaces, carries refined points over (those that no longer
/// fit go back to pending), and dissolves surfaces that fell below n. Cost follows the delta.
void retract(surfaces::Ledger& ledger, const occupancy::OccupancyDelta& delta);

/// Adds repeated observations of inlier voxels to each surface's moments. It counts points, not voxels, but
/// at most eight in a voxel, because a sensor's neighbouring readings have errors in common. A surface that
/// got nothing but evidence is not refitted before something else touches it.
void accumulate_evidence(surfaces::Ledger& ledger, const sensing::VoxelScan& scan,
                         std::span<const occupancy::OccupancyDelta::Confirmed> confirmed);

}  // namespace octosurf::upkeep
