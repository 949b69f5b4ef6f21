#pragma once

#include "surfaces/surface_store.hpp"

namespace octosurf::surfaces {

/// Extends a surface's boundary to its intersection with other surfaces. At an edge of two faces, its voxels
/// belong to one or the other, and sparse readings leave a strip on both sides; but each face ends at the
/// other's plane, and that line is as exact as the two planes.
///
/// It is extended from an inlier to the line if the line is no farther than the next reading would be: the
/// distance to the previous row of inliers, plus one voxel that may be the other's; if the other's inliers
/// start as near to the same place; and if there is no gap wider than the outline would bridge (`gap`, m).
///
/// Cost: for each tile of the boundary a few look-ups of a region, and of blocks where another plane passes;
/// there, some look-ups of a cell for each inlier and surface.
IntersectionSites find_intersections(const SurfaceModel& surface, const SurfaceStore& others, double gap);

}  // namespace octosurf::surfaces
