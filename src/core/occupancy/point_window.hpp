#pragma once

#include "geometry/morton.hpp"
#include "occupancy/key_box.hpp"
#include "occupancy/occupancy_map.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <boost/container/deque.hpp>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <tsl/robin_map.h>
#include <utility>
#include <vector>

namespace octosurf::occupancy {

/// A point inside a scan: its place in the scan's window.
enum class PointId : std::uint32_t { none = ~std::uint32_t{0} };
constexpr std::size_t index_of(PointId i) { return static_cast<std::size_t>(i); }

}  // namespace octosurf::occupancy

namespace octosurf {
using occupancy::index_of;
using occupancy::PointId;
}  // namespace octosurf

namespace octosurf::occupancy {

/// Some of a window's points. Memory: a bit for each up to the last one.
class PointSet {
 public:
  PointSet() = default;
  template <class Points>
  explicit PointSet(const Points& points) {
    for (const PointId i : points) insert(i);
  }
  bool contains(PointId i) const { return index_of(i) < has_.size() && has_[index_of(i)]; }
  bool insert(PointId i) {  ///< true if it was not in the set
    if (index_of(i) >= has_.size()) has_.resize(2 * index_of(i) + 64);
    if (has_[index_of(i)]) return false;
    return has_[index_of(i)] = true;
  }

 private:
  std::vector<bool> has_;
};

/// The octree's points around a scan's changes, loaded block by block and indexed: the data for neighbourhood
/// queries. Blocks of 8³ voxels are read from the octree on first access, so the cost follows the change.
/// Valid until the octree's next insert. Not thread-safe.
class PointWindow {
 public:
  explicit PointWindow(OccupancyMap& map) : PointWindow(reader_of(map)) { writable_ = &map; }
  /// For an octree that does not change: assign() changes the window only.
  explicit PointWindow(const OccupancyMap& map) : PointWindow(reader_of(map)) {}
  /// Appends the points of the block of 8³ voxels with this corner.
  using ReadBlock = std::function<void(geometry::VoxelKey corner, std::vector<VoxelPoint>& points)>;
  explicit PointWindow(ReadBlock read) : read_(std::move(read)) {}

  std::size_t size() const { return points_.size(); }
  /// The reference stays valid while further blocks are loaded.
  const VoxelPoint& operator[](PointId i) const { return points_[index_of(i)]; }

  /// The point in voxel `key`, or none.
  PointId find(geometry::VoxelKey key) const {
    const Block& block = blocks_[block_of(key.packed() >> 3 & block_mask)];
    const bool present = block.slices[key.z & 7] >> (8 * (key.y & 7) + (key.x & 7)) & 1;
    return present ? PointId{index_in(block, key)} : PointId::none;
  }

  /// Whether the block of 8³ voxels around it has been read.
  bool is_loaded(geometry::VoxelKey key) const { return index_.contains(key.packed() >> 3 & block_mask); }

  /// Sorts points by key, and removes repeated ones.
  void put_in_order(std::vector<PointId>& points) const {
    put_in_order(points, [](geometry::VoxelKey key) { return key.packed(); });
    points.erase(std::unique(points.begin(), points.end()), points.end());
  }
  /// Sorts them by a number of their keys; those of one number by their ids.
  template <class NumberOf>
  void put_in_order(std::vector<PointId>& points, const NumberOf& number_of) const {
    std::vector<std::pair<std::uint64_t, PointId>>
        numbered;  // beside the ids, for sorting looks at them often
    numbered.reserve(points.size());
    for (const PointId i : points) numbered.emplace_back(number_of((*this)[i].key), i);
    if (std::is_sorted(numbered.begin(), numbered.end())) return;
    std::sort(numbered.begin(), numbered.end());
    std::transform(numbered.begin(), numbered.end(), points.begin(), [](const auto& n) { return n.second; });
  }

  /// Assigns the point to a surface (0: pending), here and, if writable, in the octree.
  void assign(PointId i, SurfaceId surface) {
    VoxelPoint& point = points_[index_of(i)];
    point.surface = surface;
    if (writable_ != nullptr) writable_->assign(point, surface);
  }

  /// Replaces a point by another one in the same voxel, here alone.
  void replace(PointId i, const VoxelPoint& point) { points_[index_of(i)] = point; }

  /// visit(PointId) for every point whose voxel lies within `reach` voxels of `key` along each axis,
  /// itself included, in a fixed order. Cost: blocks met, plus points met.
  template <class Visit>
  void for_each_near(geometry::VoxelKey key, int reach, Visit&& visit) const;

  /// The same in the box from `low` to `high`, both included.
  template <class Visit>
  void for_each_in(geometry::VoxelKey low, geometry::VoxelKey high, Visit&& visit) const;

  /// Of a block of 8³ voxels: slice z, bit 8·y + x.
  using Slices = std::array<std::uint64_t, 8>;
  /// The same for those of a block, given by its packed key divided by 8, whose bits are set.
  template <class Visit>
  void for_each_of_block(std::uint64_t packed_block, const Slices& wanted, Visit&& visit) const {
    const std::uint32_t b = block_of(packed_block);
    for (unsigned z = 0; z < 8; ++z) visit_points(b, z, blocks_[b].slices[z] & wanted[z], visit);
  }

  /// Number of the points near a voxel. Cost: blocks met.
  std::size_t count_near(geometry::VoxelKey key, int reach) const {
    std::size_t count = 0;
    for_each_block_near(key, reach, [&](std::uint32_t b, const BlockPart& part) {
      for (unsigned z = part.first; z <= part.last; ++z)
        count += static_cast<std::size_t>(geometry::bit_count(blocks_[b].slices[z] & part.slice));
    });
    return count;
  }

 private:
  static ReadBlock reader_of(const OccupancyMap& map) {
    return [&map](geometry::VoxelKey corner, auto& points) { map.read_block(corner, points); };
  }
  static constexpr std::uint64_t block_mask = 0x1fff1fff1fffULL;  // three 13-bit fields
  static constexpr std::uint32_t unknown = ~std::uint32_t{0};
  struct Block {
    Slices slices{};
    std::array<std::uint64_t, 8> rows_before{};  // byte y: points in the slice's rows before row y
    std::array<std::uint16_t, 8> slices_before{};
    std::uint32_t first = 0, count = 0;
    std::array<std::uint32_t, 27> around;  // of blocks_, x fastest; unknown until accessed
  };
  static constexpr std::array<std::uint8_t, 256> bits_in_row = [] {  // faster than geometry::bit_count
    std::array<std::uint8_t, 256> bits{};
    for (unsigned row = 0; row < 256; ++row) bits[row] = static_cast<std::uint8_t>(std::popcount(row));
    return bits;
  }();
  static std::uint32_t row_in(const Block& block, unsigned y, unsigned z) {
    return block.first + block.slices_before[z] +
           static_cast<std::uint32_t>(block.rows_before[z] >> (8 * y) & 0xff);
  }
  template <class Visit>
  void for_each_block_near(geometry::VoxelKey key, int reach, Visit&& visit) const;
  /// `home`: a block; those beside it are looked up once.
  template <class Visit>
  void for_each_block_in(const Key3& low, const Key3& high, const Key3& home, Visit&& visit) const;
  template <class Visit>
  void visit_points(std::uint32_t b, unsigned z, std::uint64_t wanted, Visit&& visit) const;
  /// Its voxel must hold a point.
  static std::uint32_t index_in(const Block& block, geometry::VoxelKey key) {
    const unsigned y = key.y & 7, z = key.z & 7;
    const auto row = static_cast<unsigned>(block.slices[z] >> (8 * y) & 0xff);
    return row_in(block, y, z) + bits_in_row[row & ((1U << (key.x & 7)) - 1)];
  }
  std::uint32_t block_of(std::uint64_t packed_block) const {
    return packed_block == last_asked_ ? last_block_ : look_up(packed_block);
  }
  std::uint32_t look_up(std::uint64_t packed_block) const;
  void read_block(std::uint64_t packed_block) const;
  /// The same as block_of(packed_block), the neighbour `side` of `home`.
  std::uint32_t block_beside(std::uint32_t home, std::size_t side, std::uint64_t packed_block) const {
    if (blocks_[home].around[side] == unknown) {
      const std::uint32_t found = block_of(packed_block);
      blocks_[home].around[side] = found;
    }
    return blocks_[home].around[side];
  }

  ReadBlock read_;
  OccupancyMap* writable_ = nullptr;
  // Loaded so far.
  // Of a block: ordered by z, y, x. Elements never move; found by a shift.
  mutable boost::container::deque<VoxelPoint, void,
                                  boost::container::deque_options<boost::container::block_size<1024>>::type>
      points_;
  mutable std::vector<Block> blocks_;
  mutable tsl::robin_map<std::uint64_t, std::uint32_t, geometry::PackedKeyHash> index_;
  mutable std::uint64_t last_asked_ = ~std::uint64_t{0};  // and its block: nearby queries follow each other
  mutable std::uint32_t last_block_ = 0;
  mutable std::vector<VoxelPoint> scratch_;
};

template <class Visit>
void PointWindow::for_each_block_near(geometry::VoxelKey key, int reach, Visit&& visit) const {
  const auto at = [](int k) { return geometry::VoxelGrid::clamped(k); };
  for_each_block_in({at(key.x - reach), at(key.y - reach), at(key.z - reach)},
                    {at(key.x + reach), at(key.y + reach), at(key.z + reach)},
                    {key.x >> 3, key.y >> 3, key.z >> 3}, visit);
}

template <class Visit>
void PointWindow::for_each_block_in(const Key3& low, const Key3& high, const Key3& home,
                                    Visit&& visit) const {
  const auto packed = [](int x, int y, int z) {
    return (static_cast<std::uint64_t>(z) << 32) | (static_cast<std::uint64_t>(y) << 16) |
           static_cast<std::uint64_t>(x);
  };
  const std::uint32_t at_home = block_of(packed(home[0], home[1], home[2]));
  for (int bz = low[2] >> 3; bz <= high[2] >> 3; ++bz)
    for (int by = low[1] >> 3; by <= high[1] >> 3; ++by)
      for (int bx = low[0] >> 3; bx <= high[0] >> 3; ++bx) {
        const int dx = bx - home[0], dy = by - home[1], dz = bz - home[2];
        const bool beside = std::max({std::abs(dx), std::abs(dy), std::abs(dz)}) <= 1;
        const std::uint32_t b =
            beside ? block_beside(at_home, static_cast<std::size_t>(9 * dz + 3 * dy + dx + 13),
                                  packed(bx, by, bz))
                   : block_of(packed(bx, by, bz));
        if (blocks_[b].count > 0) visit(b, BlockPart(low, high, {bx, by, bz}));
      }
}

template <class Visit>
void PointWindow::for_each_near(geometry::VoxelKey key, int reach, Visit&& visit) const {
  for_each_block_near(key, reach, [&](std::uint32_t b, const BlockPart& part) {
    for (unsigned z = part.first; z <= part.last; ++z)
      visit_points(b, z, blocks_[b].slices[z] & part.slice, visit);
  });
}

template <class Visit>
void PointWindow::for_each_in(geometry::VoxelKey low, geometry::VoxelKey high, Visit&& visit) const {
  for_each_block_in({low.x, low.y, low.z}, {high.x, high.y, high.z}, {low.x >> 3, low.y >> 3, low.z >> 3},
                    [&](std::uint32_t b, const BlockPart& part) {
                      for (unsigned z = part.first; z <= part.last; ++z)
                        visit_points(b, z, blocks_[b].slices[z] & part.slice, visit);
                    });
}

template <class Visit>
void PointWindow::visit_points(std::uint32_t b, unsigned z, std::uint64_t wanted, Visit&& visit) const {
  for (; wanted != 0; wanted &= wanted - 1) {
    const int bit = std::countr_zero(wanted);
    const Block& block = blocks_[b];  // looked up again: visiting may load more blocks
    const auto y = static_cast<unsigned>(bit) / 8;
    const auto row = static_cast<unsigned>(block.slices[z] >> (8 * y) & 0xff);
    visit(PointId{row_in(block, y, z) + bits_in_row[row & ((1U << (bit & 7)) - 1)]});
  }
}

}  // namespace octosurf::occupancy
