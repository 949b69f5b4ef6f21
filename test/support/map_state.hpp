#pragma once

#include "occupancy/downsample.hpp"
#include "surfaces/changes.hpp"
#include "surfaces/map_state.hpp"

#include <limits>
#include <vector>

namespace octosurf::test {

/// Puts a scan into the octree only, as the mapper's first two stages do; nothing is detected.
inline OccupancyDelta occupy(MapState& state, const Scan& scan) {
  Downsampler downsample(state.occupancy.grid());
  const VoxelScan voxels = downsample(scan, 0, std::numeric_limits<double>::infinity());
  OccupancyDelta delta = state.occupancy.insert(
      voxels, downsample, state.parameters.occupancy.preserve_surfaces ? &state.surfaces : nullptr);
  state.points += delta.appeared.size();
  state.points -= delta.vanished.size();
  return delta;
}

/// Points on a rectangle as a sensor at `eye` sees them, about four to a voxel.
inline Scan rectangle_scan(const Eigen::Vector3d& eye, const Eigen::Vector3d& corner,
                           const Eigen::Vector3d& edge_u, const Eigen::Vector3d& edge_v,
                           double spacing = 0.009) {
  Scan scan;
  scan.T_map_sensor.translation() = eye;
  const auto steps = [&](const Eigen::Vector3d& e) { return static_cast<int>(e.norm() / spacing); };
  for (int v = 0; v <= steps(edge_v); ++v)
    for (int u = 0; u <= steps(edge_u); ++u)
      scan.points.push_back(
          (corner + u * spacing * edge_u.normalized() + v * spacing * edge_v.normalized() - eye)
              .cast<float>());
  return scan;
}

/// A surface of those points for which `wanted(position)` is true.
template <class Wanted>
SurfaceModel& make_surface(Workspace& work, const std::vector<VoxelPoint>& points, const Plane& plane,
                           const Wanted& wanted) {
  SurfaceModel& surface = work.state.surfaces.create(plane, points.front().position.cast<double>());
  for (const VoxelPoint& p : points)
    if (wanted(Eigen::Vector3d(p.position.cast<double>()))) work.give(work.window.find(p.key), surface);
  return surface;
}

}  // namespace octosurf::test
