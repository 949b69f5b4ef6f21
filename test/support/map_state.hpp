#pragma once

#include "sensing/downsample.hpp"
#include "support/testing.hpp"
#include "surfaces/ledger.hpp"
#include "surfaces/map_state.hpp"

namespace octosurf::test {

/// Puts a scan into the octree only, as the mapper's first two stages do; nothing is detected.
occupancy::OccupancyDelta occupy(surfaces::MapState& state, const Scan& scan);

/// Points on a rectangle as a sensor at `eye` sees them, about four to a voxel.
Scan rectangle_scan(const Eigen::Vector3d& eye, const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_u,
                    const Eigen::Vector3d& edge_v, double spacing = 0.009);

/// A reading in the middle of each voxel (of 2 cm) of a plate at z = 1 cm, in these columns along x and so
/// many rows along y, as a sensor at `eye` sees them.
Scan plate_scan(const Eigen::Vector3d& eye, int from_column, int to_column, int rows);

/// A surface of those points for which `wanted(position)` is true.
template <class Wanted>
surfaces::SurfaceModel& make_surface(surfaces::Ledger& ledger,
                                     const std::vector<occupancy::VoxelPoint>& points, const Plane& plane,
                                     const Wanted& wanted) {
  surfaces::SurfaceModel& surface = ledger.create(plane, points.front().position.cast<double>());
  for (const occupancy::VoxelPoint& p : points)
    if (wanted(Eigen::Vector3d(p.position.cast<double>()))) ledger.give(ledger.window.find(p.key), surface);
  return surface;
}

}  // namespace octosurf::test
