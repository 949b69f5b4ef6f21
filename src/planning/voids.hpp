#pragma once

#include "planning/cell_raster.hpp"

#include <Eigen/Core>
#include <functional>

#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Whether the voxels on the plane and behind it are free at (u, v).
using IsOpen = std::function<bool(const Eigen::Vector2d&)>;

/// Marks where a surface's outline, which closes gaps narrower than h, spans a void.
///
/// 1. Evidence are places of the plane that a ray passed: where it crossed the plane on its way to a reading
///    behind it, of another surface or of none, as far as the stored view says where; and `is_open` places.
/// 2. The void is the union of the discs that hold such a place and no reading of the surface: how far it
///    extends between them is unknown. Discs from 1.5 voxels on count, about cells inside the polygons.
///
/// The voids are marked in `cells`, a raster of edge d/2 about the surface's polygons; half a cell more, so
/// that nothing is left of one beside its readings. Cost: the occupied voxels about the plane, some 50 ns
/// each, the cells inside, some ns each, and 1 µs for each cell without readings about it.
void mark_voids(const Surface& surface, const OccupancyView& octree, const IsOpen& is_open,
                const CellRaster& cells, Mask& voids);

}  // namespace octosurf::planning
