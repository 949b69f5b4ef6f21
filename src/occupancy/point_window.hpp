#pragma once

#include "occupancy/occupancy_map.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf {

/// The octree's points around what a scan changed, block by block, with an index for each: what
/// neighbourhood queries run on. Blocks of 8³ voxels are read from the octree when first asked for,
/// so the cost follows the change. Valid until the octree's next insert.
class PointWindow {
 public:
  using Index = std::uint32_t;
  static constexpr Index none = ~Index{0};

  explicit PointWindow(OccupancyMap& map) : map_(map) {}

  std::size_t size() const { return points_.size(); }
  const VoxelPoint& operator[](Index i) const { return points_[i]; }

  /// Index of the point in voxel `key`, or none.
  Index find(VoxelKey key);

  /// Gives the point to a surface (0: pending), here and in the octree.
  void assign(Index i, SurfaceId surface) {
    points_[i].surface = surface;
    map_.assign(points_[i], surface);
  }

  /// visit(Index) for every point whose voxel lies within `reach` voxels of `key` along each axis,
  /// itself included, in a fixed order. Cost: blocks met, plus points met.
  template <class Visit>
  void for_each_near(VoxelKey key, int reach, Visit&& visit);

  /// Loads the block of `key`, if it is not there yet.
  void load(VoxelKey key) { block_of(key.packed() >> 3 & block_mask); }

  /// First index and count of the points of the block that holds `key`.
  std::pair<Index, Index> block_points(VoxelKey key) {
    const Block& block = block_at(block_of(key.packed() >> 3 & block_mask));
    return {block.first, block.count};
  }

 private:
  static constexpr std::uint64_t block_mask = 0x1fff1fff1fffULL;  // three 13-bit fields
  struct Block {
    std::array<std::uint64_t, 8> rows{};    // slice z; bit 8·y + x
    std::array<std::uint16_t, 8> before{};  // points in the slices below
    Index first = 0;
    Index count = 0;
  };
  const Block& block_at(std::uint32_t b) const { return blocks_[b]; }
  std::uint32_t block_of(std::uint64_t packed_block);

  OccupancyMap& map_;
  std::vector<VoxelPoint> points_;  // of a block: ordered by z, y, x
  std::vector<Block> blocks_;
  tsl::robin_map<std::uint64_t, std::uint32_t, PackedKeyHash> index_;
  std::vector<VoxelPoint> scratch_;
};

template <class Visit>
void PointWindow::for_each_near(VoxelKey key, int reach, Visit&& visit) {
  const std::array<int, 3> low{std::max(0, key.x - reach), std::max(0, key.y - reach),
                               std::max(0, key.z - reach)};
  const std::array<int, 3> high{std::min(65535, key.x + reach), std::min(65535, key.y + reach),
                                std::min(65535, key.z + reach)};
  for (int bz = low[2] >> 3; bz <= high[2] >> 3; ++bz)
    for (int by = low[1] >> 3; by <= high[1] >> 3; ++by)
      for (int bx = low[0] >> 3; bx <= high[0] >> 3; ++bx) {
        const std::uint64_t packed = (static_cast<std::uint64_t>(bz) << 32) |
                                     (static_cast<std::uint64_t>(by) << 16) | static_cast<std::uint64_t>(bx);
        const Block block = block_at(block_of(packed));  // a copy: visiting may load more blocks
        if (block.count == 0) continue;
        const auto cut = [](int v, int b) { return std::clamp(v - 8 * b, 0, 7); };
        const unsigned x0 = static_cast<unsigned>(cut(low[0], bx)),
                       x1 = static_cast<unsigned>(cut(high[0], bx));
        const unsigned y0 = static_cast<unsigned>(cut(low[1], by)),
                       y1 = static_cast<unsigned>(cut(high[1], by));
        const std::uint64_t row = (0xffULL >> (7 - x1 + x0)) << x0;
        std::uint64_t slice = 0;
        for (unsigned y = y0; y <= y1; ++y) slice |= row << (8 * y);
        for (int z = cut(low[2], bz); z <= cut(high[2], bz); ++z) {
          const std::uint64_t present = block.rows[static_cast<std::size_t>(z)];
          for (std::uint64_t bits = present & slice; bits != 0; bits &= bits - 1) {
            const std::uint64_t below = present & ((bits & -bits) - 1);
            visit(block.first + block.before[static_cast<std::size_t>(z)] +
                  static_cast<Index>(std::popcount(below)));
          }
        }
      }
}

}  // namespace octosurf
