#pragma once

#include "occupancy/neighbours.hpp"
#include "surfaces/map_state.hpp"

namespace octosurf::surfaces {

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

  /// Whether the voxel has a point without a surface.
  bool is_pending(geometry::VoxelKey key) const {
    const PointId i = window.find(key);
    return i != PointId::none && window[i].surface == 0;
  }
};

}  // namespace octosurf::surfaces
