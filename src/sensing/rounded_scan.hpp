#pragma once

#include "sensing/downsample.hpp"
#include "sensing/noise_model.hpp"

namespace octosurf::sensing {

/// Brings a scan into the form in which an archive keeps it: mapped like this, it is mapped again to the bit.
/// That holds within a third of the octree's reach from its origin (200 m at 2 cm), where float still tells
/// 512ths of a voxel apart after two roundings.
///
/// 1. Voxels in Morton order.
/// 2. A mean point stands in the middle of a 256th of its voxel, as in the octree, or of a coarser step where
///    noise makes finer ones idle. Rounding to steps of q adds q²/12 to a coordinate's variance, and may add
///    a hundredth of what it has. n readings of a voxel count as 8n/(8 + n) that know nothing of each other
///    (accumulate_evidence()), each with the noise's `measured_sigma` for its distance: so q ≤ measured_sigma
///    · √(0.12 · (8 + n)/(8n)), and at least d/256.
/// 3. Numbers of readings have three significant binary digits; 8n/(8 + n) moves by 5 % at most.
/// 4. What lies beyond the range only frees the way to its voxel's centre, and says no more than that.
void round_scan(VoxelScan& scan, const geometry::VoxelGrid& grid, const NoiseModel& noise);

/// The same for a scan that was rounded before and comes from an archive: only what was rounded to is
/// restored.
void restore_rounded(VoxelScan& scan, const geometry::VoxelGrid& grid);

}  // namespace octosurf::sensing
