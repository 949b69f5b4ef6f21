#pragma once

#include "occupancy/downsample.hpp"
#include "surfaces/changes.hpp"

namespace octosurf {

/// Hands a scan's readings to the surfaces that they lie on as evidence of their planes, when every point
/// has found its place.
///
/// Noise spreads a plane's readings over the two or three voxels that one line of sight crosses. The mean
/// of what fell in one voxel leans toward that voxel's middle, a voxel that noise reached once counts as
/// much as one that it hits each time, and rays keep the voxels before a plane free, those behind it not:
/// planes through voxels' points come to lie too deep, the more so the more scans there are. So all
/// readings over one cell of the plane are taken together here, whatever became of their voxels.
///
/// 1. A reading is of the surface that its voxel belongs to, or of the nearest one within the tolerance.
/// 2. The two outermost rows of cells are left out. Readings of a neighbouring face lie within the tolerance
///    there: a voxel that an edge crosses may belong to either face, so that the outermost cell may lie
///    beyond the edge, and the edge in the second one.
/// 3. A cell's mean weighs by the readings in it, as eight at most, because a sensor's neighbouring
///    readings err alike, and by their noise along the normal.
///
/// O(ends). Surfaces with new evidence only are not refitted before something else touches them.
void observe(Workspace& work, const VoxelScan& scan, const OccupancyDelta& delta);

}  // namespace octosurf
