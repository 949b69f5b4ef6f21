#pragma once

#include "occupancy/key_box.hpp"
#include "occupancy/point_window.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
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
    for_each_point_while(
        window, place, [] { return true; }, visit);
  }
  /// The same until go_on() is false between parts of up to 8³ voxels, which the window reads at once.
  template <class GoOn, class Visit>
  void for_each_point_while(const occupancy::PointWindow& window, Place place, GoOn&& go_on,
                            Visit&& visit) const {
    const geometry::VoxelKey block = geometry::VoxelKey::unpack(place);
    const auto begin = [this](std::uint16_t k) { return k * edge_; };
    const auto end = [&](std::uint16_t k) { return std::min(65535, begin(k) + edge_ - 1); };
    const auto key = [](int x, int y, int z) {
      return geometry::VoxelKey{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                                static_cast<std::uint16_t>(z)};
    };
    for (int z = begin(block.z); z <= end(block.z); z = (z | 7) + 1)
      for (int y = begin(block.y); y <= end(block.y); y = (y | 7) + 1)
        for (int x = begin(block.x); x <= end(block.x) && go_on(); x = (x | 7) + 1)
          window.for_each_in(key(x, y, z),
                             key(std::min(x | 7, end(block.x)), std::min(y | 7, end(block.y)),
                                 std::min(z | 7, end(block.z))),
                             visit);
  }

  /// The blocks up to `voxels` voxels from one of `places`, themselves included, each once; in order.
  std::vector<Place> widened(std::vector<Place> places, int voxels) const;
  /// The box around the points in each block, with so many voxels more on each side.
  std::map<Place, occupancy::KeyBox> boxes(const occupancy::PointWindow& window,
                                           std::span<const PointId> points, int voxels) const;

 private:
  geometry::VoxelKey part(geometry::VoxelKey key) const {
    const auto divided = [this](std::uint16_t k) { return static_cast<std::uint16_t>(k / edge_); };
    return {divided(key.x), divided(key.y), divided(key.z)};
  }

  int edge_;
};

}  // namespace octosurf::detection
