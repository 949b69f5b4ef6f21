#pragma once

#include "occupancy/neighbours.hpp"
#include "surfaces/map_state.hpp"

#include <cstdint>

namespace octosurf::surfaces {

class Cells;
class ThreadViews;

/// Read access for stages: the map's surfaces, and its points around the changes. Blocks of points
/// and their neighbours are loaded on first access.
struct MapView {
  const Parameters& parameters;
  const occupancy::OccupancyMap& octree;
  const geometry::VoxelGrid& grid;
  const SurfaceStore& surfaces;
  const CylinderStore& cylinders;
  const sensing::NoiseModel& noise;
  const occupancy::PointWindow& window;
  const occupancy::Neighbours& neighbours;
  const Cells& cells;              ///< coarser ones, on which planes are found
  const ThreadViews& for_threads;  ///< the same view for other threads
  int level = 0;  ///< the window's points are those of cells of 2^level voxels along each edge

  /// Key of the cell that holds a voxel. Cells, too, begin at coordinate 0.
  geometry::VoxelKey cell_of(geometry::VoxelKey voxel) const {
    const auto part = [this](std::uint16_t k) { return key(((k - grid.origin) >> level) + grid.origin); };
    return {part(voxel.x), part(voxel.y), part(voxel.z)};
  }
  geometry::VoxelKey first_voxel_of(geometry::VoxelKey cell) const { return voxel_in(cell, 0); }
  geometry::VoxelKey last_voxel_of(geometry::VoxelKey cell) const { return voxel_in(cell, (1 << level) - 1); }
  /// The point of the cell that holds a voxel, or none.
  PointId find(geometry::VoxelKey voxel) const { return window.find(cell_of(voxel)); }
  /// Whether it is a point without a surface; false for none.
  bool is_pending(PointId i) const { return i != PointId::none && window[i].surface == 0; }

 private:
  static std::uint16_t key(int k) { return static_cast<std::uint16_t>(geometry::VoxelGrid::clamped(k)); }
  geometry::VoxelKey voxel_in(geometry::VoxelKey cell, int beyond) const {
    const auto part = [&](std::uint16_t k) {
      return key((k - grid.origin) * (1 << level) + grid.origin + beyond);
    };
    return {part(cell.x), part(cell.y), part(cell.z)};
  }
};

}  // namespace octosurf::surfaces
