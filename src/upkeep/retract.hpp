#pragma once

#include "sensing/downsample.hpp"
#include "surfaces/scan_changes.hpp"

#include <span>

namespace octosurf {

/// Takes vanished voxels out of their surfaces, carries refined points over (those that no longer
/// fit go back to pending), and dissolves surfaces that fell below n. Cost follows the delta.
void retract(Workspace& work, const OccupancyDelta& delta);

/// Hands what the scan saw again to the surfaces as evidence of their planes. Counts points, not
/// voxels: at most eight a voxel, because a sensor's neighbouring readings err alike. Surfaces with new
/// evidence only are not refitted before something else touches them.
void confirm(Workspace& work, const VoxelScan& scan, std::span<const OccupancyDelta::Confirmed> confirmed);

}  // namespace octosurf
