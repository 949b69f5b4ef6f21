#pragma once

#include "planning/cell_raster.hpp"
#include "planning/column.hpp"

#include <octosurf/occupancy.hpp>

namespace octosurf::planning {

/// Marks where a surface's outline, which closes gaps narrower than h, spans a void.
///
/// 1. Evidence are places of the plane that a ray passed: where it crossed the plane on its way to a reading
///    behind it, of another surface or of none, within the stored view's error; and places that are open
///    (Columns::open_through()).
/// 2. The void is the union of the discs that hold such a place and no reading of the surface: how far it
///    extends between them is unknown. Discs from 1.5 voxels on count, about cells inside the outline.
///
/// The voids are marked in `cells`, a raster of edge d/2, half a cell larger, so that they end at their
/// readings. Cells more than void_reach from its border are as in any larger raster. Cost: the
/// occupied voxels close behind the plane; where there is evidence also its readings, some 50 ns each, and
/// 1 µs for each cell without readings about it.
void mark_voids(const GroundPlane& plane, const OccupancyView& octree, const Columns& columns,
                const CellRaster& cells, const Mask& inside, Mask& voids);

/// Voxels: reach along the plane of the voxels that a place depends on: of the surface or free ones; and of
/// those behind the plane, whose rays slant.
inline constexpr double void_reach = 18, slanted_reach = 11;
/// Voxels behind the plane: deeper readings are no evidence.
inline constexpr double deepest_evidence = 21.5;

}  // namespace octosurf::planning
