#pragma once

#include "io/exporters/page_block.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <octosurf/page.hpp>

// The parts of a page's data; fields are documented in web/src/data.js.

namespace octosurf::io {

/// Surfaces, cylinders, departures since a revision, and changes.
void add_surfaces(PageBlock& block, const PageMap& map, std::uint64_t departed_since = 0);

/// Which way is up.
void add_up(PageBlock& block, const Eigen::Vector3d& up);

/// Contact regions.
void add_feet(PageBlock& block, const PageMap& map);

/// Plans. Throws Error(data) for an invalid one.
void add_plans(PageBlock& block, const PageMap& map);

/// A coordinate of a polygon of that surface as it is stored. Throws Error(data) if it is not finite.
std::int32_t page_polygon_steps(double coordinate, SurfaceId id);

/// An occupied voxel, or several merged to a larger one.
struct PageVoxel {
  int x = 0, y = 0, z = 0;  ///< its corner over its edge
  float log_odds = 0;
  SurfaceId surface = 0;
};

/// All occupied voxels, by z, then y, then x.
std::vector<PageVoxel> occupied_voxels(const OccupancyView& octree);

/// Merged to voxels of `times` the edge, in the same order.
std::vector<PageVoxel> merge_voxels(const std::vector<PageVoxel>& voxels, int times);

/// `size`: their edge, m.
void add_voxels(PageBlock& block, const std::vector<PageVoxel>& voxels, double size,
                const Snapshot& snapshot);

/// Horizontal slices through the octree, over the extent of the `voxels`, which are of edge `size`.
void add_slices(PageBlock& block, const OccupancyView& octree, const std::vector<PageVoxel>& voxels,
                double size, const Eigen::Vector3d& up);

}  // namespace octosurf::io
