#pragma once

#include "geometry/morton.hpp"
#include "occupancy/occupancy_map.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <octosurf/occupancy.hpp>

namespace octosurf::test {

inline OccupancyParameters with_resolution(double resolution, double occupied = 0.5) {
  OccupancyParameters parameters;
  parameters.resolution = resolution;
  parameters.occupied = occupied;
  return parameters;
}

/// By one thread, without surfaces.
inline void insert(occupancy::OccupancyMap& map, const Scan& scan) {
  sensing::Downsampler downsample(map.grid());
  map.insert(downsample(scan, 0, 30), downsample, nullptr);
}

/// All nodes, as a map file has them.
inline std::string bytes_of(const occupancy::OccupancyMap& map) {
  std::string bytes;
  map.write_nodes([&](const std::string& chunk) { bytes += chunk; });
  return bytes;
}

/// In Morton order.
inline std::vector<occupancy::VoxelPoint> points_of(const occupancy::OccupancyMap& map) {
  std::vector<occupancy::VoxelPoint> points;
  map.for_each_point([&](const occupancy::VoxelPoint& p) { points.push_back(p); });
  return points;
}

inline std::uint64_t morton(geometry::VoxelKey k) { return geometry::morton_of(k.x, k.y, k.z); }

/// Calls with the key of every voxel in a cube of 2^level of them to an edge.
template <class Corner, class Visit>
void for_each_voxel_of(const Corner& corner, int level, const Visit& visit) {
  const int edge = 1 << level;
  for (int i = 0; i < edge * edge * edge; ++i)
    visit(geometry::VoxelKey{static_cast<std::uint16_t>(corner[0] + i % edge),
                             static_cast<std::uint16_t>(corner[1] + i / edge % edge),
                             static_cast<std::uint16_t>(corner[2] + i / edge / edge)});
}

}  // namespace octosurf::test
