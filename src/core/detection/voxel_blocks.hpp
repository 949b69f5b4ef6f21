#pragma once

#include "occupancy/point_window.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace octosurf::detection {

/// Partitions space into cubes of `edge` voxels; the last ones of the octree may be cut off.
class VoxelBlocks {
 public:
  using Place = std::uint64_t;  ///< a block's voxel keys divided by the edge, packed

  explicit VoxelBlocks(int edge) : edge_(edge) {}

  Place of(geometry::VoxelKey key) const { return part(key).packed(); }

  /// visit(PointId) for every point in a block, in the window's order.
  template <class Visit>
  void for_each_point(const occupancy::PointWindow& window, Place place, Visit&& visit) const {
    const geometry::VoxelKey block = geometry::VoxelKey::unpack(place);
    const auto voxel = [this](std::uint16_t k, int i) {
      return static_cast<std::uint16_t>(std::min(65535, k * edge_ + i));
    };
    const int last = edge_ - 1;
    window.for_each_in({voxel(block.x, 0), voxel(block.y, 0), voxel(block.z, 0)},
                       {voxel(block.x, last), voxel(block.y, last), voxel(block.z, last)}, visit);
  }

  struct Box {
    geometry::VoxelKey low, high;  ///< both included
  };
  /// visit(Box) for the parts of a block, of up to 8³ voxels of one block of the window, until it returns
  /// false.
  template <class Visit>
  void for_each_part(Place place, Visit&& visit) const {
    const geometry::VoxelKey block = geometry::VoxelKey::unpack(place);
    const auto begin = [this](std::uint16_t k) { return k * edge_; };
    const auto end = [&](std::uint16_t k) { return std::min(65535, begin(k) + edge_ - 1); };
    const auto key = [](int x, int y, int z) {
      return geometry::VoxelKey{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                                static_cast<std::uint16_t>(z)};
    };
    for (int z = begin(block.z); z <= end(block.z); z = (z | 7) + 1)
      for (int y = begin(block.y); y <= end(block.y); y = (y | 7) + 1)
        for (int x = begin(block.x); x <= end(block.x); x = (x | 7) + 1)
          if (!visit(Box{key(x, y, z), key(std::min(x | 7, end(block.x)), std::min(y | 7, end(block.y)),
                                           std::min(z | 7, end(block.z)))}))
            return;
  }

  /// The blocks up to `voxels` voxels from one of `places`, themselves included, each once; in order.
  std::vector<Place> widened(std::vector<Place> places, int voxels) const;

 private:
  geometry::VoxelKey part(geometry::VoxelKey key) const {
    const auto divided = [this](std::uint16_t k) { return static_cast<std::uint16_t>(k / edge_); };
    return {divided(key.x), divided(key.y), divided(key.z)};
  }

  int edge_;
};

}  // namespace octosurf::detection
