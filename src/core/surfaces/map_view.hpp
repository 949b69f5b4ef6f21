#pragma once

#include "surfaces/map_state.hpp"
#include "surfaces/normal_field.hpp"

namespace octosurf::surfaces {

/// Read access for stages: the map's surfaces, and its points around the changes. Blocks of points and their
/// normals are loaded on first access.
struct MapView {
  using Index = occupancy::PointWindow::Index;

  const Parameters& parameters;
  const geometry::VoxelGrid& grid;
  const SurfaceStore& surfaces;
  const CylinderStore& cylinders;
  const sensing::NoiseModel& noise;
  const occupancy::PointWindow& window;
  const NormalField& normals;

  /// Whether the voxel has a point without a surface.
  bool is_pending(geometry::VoxelKey key) const {
    const Index i = window.find(key);
    return i != occupancy::PointWindow::none && window[i].surface == 0;
  }
};

}  // namespace octosurf::surfaces
