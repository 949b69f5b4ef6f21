#pragma once

#include "occupancy/voxel_grid.hpp"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf {

/// One distinct voxel that scan points ended in (paper III-A1).
struct EndVoxel {
  VoxelKey key;
  std::uint32_t count = 0;                             ///< points in it
  Eigen::Vector3f centroid = Eigen::Vector3f::Zero();  ///< of them, map frame
};

/// A scan grouped by voxel, in the map frame.
struct VoxelScan {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  double max_range = std::numeric_limits<double>::infinity();
  std::vector<EndVoxel> ends;  ///< in the order in which the scan first touches them
  std::size_t not_finite = 0, too_near = 0, out_of_map = 0, beyond_range = 0;

  /// OctoMap's rule: an end voxel is a hit if its centre is within max_range; else a free ray.
  bool within_range(const Eigen::Vector3f& centre) const {
    const Eigen::Vector3f v = centre - origin;
    return std::sqrt(static_cast<double>(v.x() * v.x() + v.y() * v.y() + v.z() * v.z())) <= max_range;
  }
};

/// Groups points by voxel. Neighbouring points mostly share a cube of 4³ voxels, so the table that is
/// kept between scans is one of cubes, each with the places of its 64 voxels, and is asked only when
/// a point leaves the cube of the one before. O(points); about 12 ns a point.
class Downsampler {
 public:
  explicit Downsampler(const VoxelGrid& grid) : grid_(grid) {}

  /// `scan` must have a rigid pose. Throws Error(data) if the sensor itself is outside the octree.
  VoxelScan operator()(const Scan& scan, double min_range, double max_range);

  /// Index into the last result's `ends`, or −1.
  std::int64_t find(VoxelKey key) const;

 private:
  using Cube = std::array<std::uint32_t, 64>;  // place in `ends` plus one; 0: none
  struct Slot {
    std::uint64_t cube = empty;
    std::uint32_t index = 0;
  };
  static constexpr std::uint64_t empty = ~std::uint64_t{0};
  static std::uint64_t cube_of(VoxelKey key) { return key.packed() >> 2 & 0x3fff3fff3fffULL; }
  static std::size_t place_in_cube(VoxelKey key) {
    return (key.x & 3U) | (key.y & 3U) << 2 | (key.z & 3U) << 4;
  }
  std::size_t slot_of(std::uint64_t cube) const;
  std::uint32_t cube_index(std::uint64_t cube);
  void clear();
  void group(const Eigen::Vector3f& in_map, VoxelKey key, VoxelScan& out);

  VoxelGrid grid_;
  std::vector<Slot> slots_;
  std::vector<Cube> cubes_;
  std::size_t used_ = 0;             // cubes of this scan
  std::uint64_t last_cube_ = empty;  // of the point before
  std::uint32_t last_index_ = 0;
};

}  // namespace octosurf
