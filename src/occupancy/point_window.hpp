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

  /// What is asked of many points at once, column by column; each is `padding` longer than size().
  struct Columns {
    std::vector<float> x, y, z, view_x, view_y, view_z;
    std::vector<SurfaceId> surface;
  };
  static constexpr std::size_t padding = 4;
  const Columns& columns() const { return columns_; }

  /// Index of the point in voxel `key`, or none.
  Index find(VoxelKey key);

  /// Gives the point to a surface (0: pending), here and in the octree.
  void assign(Index i, SurfaceId surface) {
    points_[i].surface = columns_.surface[i] = surface;
    map_.assign(points_[i], surface);
  }

  /// visit(Index) for every point whose voxel lies within `reach` voxels of `key` along each axis,
  /// itself included, in a fixed order. Cost: blocks met, plus points met.
  template <class Visit>
  void for_each_near(VoxelKey key, int reach, Visit&& visit) {
    for_each_run_near(key, reach, [&](Index first, Index last) {
      for (Index i = first; i < last; ++i) visit(i);
    });
  }

  /// The same points as runs [first, last) of neighbours in a row: visit(Index, Index).
  template <class Visit>
  void for_each_run_near(VoxelKey key, int reach, Visit&& visit);

 private:
  static constexpr std::uint64_t block_mask = 0x1fff1fff1fffULL;  // three 13-bit fields
  static constexpr std::uint32_t unknown = ~std::uint32_t{0};
  struct Block {
    std::array<std::uint64_t, 8> slices{};       // slice z; bit 8·y + x
    std::array<std::uint64_t, 8> rows_before{};  // byte y: points in the slice's rows before row y
    std::array<std::uint16_t, 8> slices_before{};
    Index first = 0;
    Index count = 0;
    std::array<std::uint32_t, 27> around;  // of blocks_, x fastest; unknown until asked for
  };
  static constexpr std::array<std::uint8_t, 256> bits_in_row = [] {  // std::popcount would be a call
    std::array<std::uint8_t, 256> bits{};
    for (unsigned row = 0; row < 256; ++row) bits[row] = static_cast<std::uint8_t>(std::popcount(row));
    return bits;
  }();
  static Index row_in(const Block& block, unsigned y, unsigned z) {
    return block.first + block.slices_before[z] + static_cast<Index>(block.rows_before[z] >> (8 * y) & 0xff);
  }
  static Index index_in(const Block& block, VoxelKey key);  // its voxel must hold a point
  std::uint32_t block_of(std::uint64_t packed_block);
  void read_block(std::uint64_t packed_block);
  void place(Index i, const VoxelPoint& p);
  /// The same as block_of(packed_block), which is `side` of `home`.
  std::uint32_t block_beside(std::uint32_t home, std::size_t side, std::uint64_t packed_block) {
    if (blocks_[home].around[side] == unknown) {
      const std::uint32_t found = block_of(packed_block);
      blocks_[home].around[side] = found;
    }
    return blocks_[home].around[side];
  }

  OccupancyMap& map_;
  std::vector<VoxelPoint> points_;  // of a block: ordered by z, y, x
  Columns columns_;
  std::vector<Block> blocks_;
  tsl::robin_map<std::uint64_t, std::uint32_t, PackedKeyHash> index_;
  std::uint64_t last_asked_ = ~std::uint64_t{0};  // and its block: neighbours are asked for together
  std::uint32_t last_block_ = 0;
  std::vector<VoxelPoint> scratch_;
};

template <class Visit>
void PointWindow::for_each_run_near(VoxelKey key, int reach, Visit&& visit) {
  const std::array<int, 3> low{std::max(0, key.x - reach), std::max(0, key.y - reach),
                               std::max(0, key.z - reach)};
  const std::array<int, 3> high{std::min(65535, key.x + reach), std::min(65535, key.y + reach),
                                std::min(65535, key.z + reach)};
  const auto cut = [](int v, int b) { return static_cast<unsigned>(std::clamp(v - 8 * b, 0, 7)); };
  const int hx = key.x >> 3, hy = key.y >> 3, hz = key.z >> 3;
  const std::uint32_t home = block_of(key.packed() >> 3 & block_mask);
  for (int bz = low[2] >> 3; bz <= high[2] >> 3; ++bz)
    for (int by = low[1] >> 3; by <= high[1] >> 3; ++by)
      for (int bx = low[0] >> 3; bx <= high[0] >> 3; ++bx) {
        const std::uint64_t packed = (static_cast<std::uint64_t>(bz) << 32) |
                                     (static_cast<std::uint64_t>(by) << 16) | static_cast<std::uint64_t>(bx);
        const auto side = static_cast<std::size_t>(9 * (bz - hz) + 3 * (by - hy) + (bx - hx) + 13);
        const std::uint32_t b = reach <= 8 ? block_beside(home, side, packed) : block_of(packed);
        if (blocks_[b].count == 0) continue;
        const unsigned x0 = cut(low[0], bx), x1 = cut(high[0], bx);
        const unsigned y0 = cut(low[1], by), y1 = cut(high[1], by);
        const std::uint64_t row = (0xffULL >> (7 - x1 + x0)) << x0;
        const std::uint64_t rows = (~0ULL >> (8 * (7 - y1 + y0))) << (8 * y0);
        const std::uint64_t wanted = row * 0x0101010101010101ULL & rows;
        for (unsigned z = cut(low[2], bz); z <= cut(high[2], bz); ++z)
          for (std::uint64_t left = blocks_[b].slices[z] & wanted; left != 0;) {
            const Block& block = blocks_[b];  // looked up again: visiting may load more blocks
            const auto y = static_cast<unsigned>(std::countr_zero(left)) / 8;
            const auto present = static_cast<unsigned>(block.slices[z] >> (8 * y) & 0xff);
            const Index first = row_in(block, y, z) + bits_in_row[present & ((1U << x0) - 1)];
            left &= ~(0xffULL << (8 * y));
            visit(first, first + bits_in_row[present & static_cast<unsigned>(row)]);
          }
      }
}

}  // namespace octosurf
