#pragma once

#include "surfaces/map_state.hpp"
#include "surfaces/normal_field.hpp"

namespace octosurf::surfaces {

/// What stages read: the map's surfaces and its points around what has changed. Blocks of points and their
/// normals are loaded when they are first asked for; nothing else changes through it.
struct MapView {
  using Index = occupancy::PointWindow::Index;

  const Parameters& parameters;
  const geometry::VoxelGrid& grid;
  const SurfaceStore& surfaces;
  const CylinderStore& cylinders;
  const sensing::NoiseModel& noise;
  const occupancy::PointWindow& window;
  const NormalField& normals;

  /// There is a point in the voxel, and no surface has it.
  bool is_pending(geometry::VoxelKey key) const {
    const Index i = window.find(key);
    return i != occupancy::PointWindow::none && window[i].surface == 0;
  }
};

}  // namespace octosurf::surfaces
