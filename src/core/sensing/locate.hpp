#pragma once

#include "geometry/voxel_grid.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>

namespace octosurf::sensing {

/// A block of a scan's points in the map frame, with their voxels.
struct LocatedPoints {
  static constexpr std::size_t most = 256;
  std::array<float, most> x, y, z;  ///< map frame, m
  std::array<std::int32_t, most> key_x, key_y, key_z;
  std::array<std::int32_t, most> inside;  ///< 0: not finite, or outside the octree
};

/// Transforms up to LocatedPoints::most points to the map frame, in double, and finds their voxels as
/// VoxelGrid::key_of does. Four at a time, with the same rounding as one by one, with AVX2 or without. About
/// 4 ns a point.
void locate(std::span<const Eigen::Vector3f> points, const Eigen::Isometry3d& T_map_sensor,
            const geometry::VoxelGrid& grid, LocatedPoints& out);

}  // namespace octosurf::sensing
