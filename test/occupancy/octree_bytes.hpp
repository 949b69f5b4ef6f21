#pragma once

#include "geometry/morton.hpp"
#include "occupancy/occupancy_map.hpp"

#include <cstdint>
#include <string>

namespace octosurf::test {

/// All nodes, as a map file has them.
inline std::string bytes_of(const occupancy::OccupancyMap& map) {
  std::string bytes;
  map.write_nodes([&](const std::string& chunk) { bytes += chunk; });
  return bytes;
}

inline std::uint64_t morton(geometry::VoxelKey k) { return geometry::morton_of(k.x, k.y, k.z); }

}  // namespace octosurf::test
