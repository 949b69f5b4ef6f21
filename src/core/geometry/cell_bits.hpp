#pragma once

#include "geometry/voxel_key.hpp"

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::geometry {

/// Cell of a surface's plane hash, edge d.
struct PlaneCell {
  std::int32_t u = 0, v = 0;
  std::uint64_t packed() const {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v)) << 32 | static_cast<std::uint32_t>(u);
  }
  static PlaneCell unpack(std::uint64_t p) {
    return {static_cast<std::int32_t>(static_cast<std::uint32_t>(p)),
            static_cast<std::int32_t>(static_cast<std::uint32_t>(p >> 32))};
  }
};

/// Occupied cells of a plane hash, cells deep inside (5 × 5 cells around them occupied), and changes of
/// either or of content since the last take_changes(). Bit masks, 64 cells to a tile: half a byte a cell.
class CellBits {
 public:
  /// 8 × 8 cells; cell (u, v) of the plane is bit (v mod 8) · 8 + u mod 8 of tile (⌊u/8⌋, ⌊v/8⌋).
  struct Cells {
    PlaneCell tile;
    std::uint64_t bits = 0;

    /// Of the cells, of which there must be some, in cells of the plane.
    Eigen::AlignedBox2d box() const;
    template <class Visit>
    void for_each(Visit&& visit) const {
      for (std::uint64_t left = bits; left != 0; left &= left - 1) {
        const int bit = std::countr_zero(left);
        visit(PlaneCell{tile.u * 8 + bit % 8, tile.v * 8 + bit / 8});
      }
    }
  };

  static PlaneCell tile_of(PlaneCell cell) { return {cell.u >> 3, cell.v >> 3}; }
  static int bit_of(PlaneCell cell) { return (cell.v & 7) * 8 + (cell.u & 7); }

  bool occupied(PlaneCell cell) const {
    const auto tile = tiles_.find(tile_of(cell).packed());
    return tile != tiles_.end() && (tile->second.occupied >> bit_of(cell) & 1) != 0;
  }
  /// Occupied cells among the 5 × 5 around one: bit 5·(v + 2) + u + 2 for the cell at offset (u, v).
  std::uint32_t around(PlaneCell cell) const;
  /// Occupied cells from this one on: bit u of rows[v] for the cell at offset (u, v), u < `columns` ≤ 64.
  void rows_from(PlaneCell first, int columns, std::span<std::uint64_t> rows) const;
  /// As of the last take_changes().
  bool deep_inside(PlaneCell cell) const {
    const auto tile = tiles_.find(tile_of(cell).packed());
    return tile != tiles_.end() && (tile->second.deep >> bit_of(cell) & 1) != 0;
  }

  /// Records that an inlier was added to or removed from a cell. False if that alone cannot change an
  /// outline: the cell is deep inside and stays occupied.
  bool change(PlaneCell cell, bool occupied);
  /// Marks all content as changed.
  void change_all();
  void clear();

  /// Updates deep_inside() (with `thin` false no cell is), and returns the cells whose part in the outline
  /// may have changed, tiles in order: their content, or a cell within two of theirs, changed. Cost follows
  /// the tiles with changes.
  std::vector<Cells> take_changes(bool thin);

  /// Calls visit(Cells) with the occupied cells of each tile, in no particular order.
  template <class Visit>
  void for_each_tile(Visit&& visit) const {
    for (const auto& [key, tile] : tiles_)
      if (tile.occupied != 0) visit(Cells{PlaneCell::unpack(key), tile.occupied});
  }
  /// Occupied cells not deep inside, as of the last take_changes(). O(tiles).
  std::vector<Cells> boundary() const;

 private:
  struct Tile {
    std::uint64_t occupied = 0, taken = 0 /* occupied as of the last take_changes() */, deep = 0, changed = 0;
  };
  using Rows = std::array<std::uint64_t, 12>;
  template <class Select>
  Rows rows_about(PlaneCell tile, Select&& bits_of) const;
  std::uint64_t eroded(PlaneCell tile) const;
  std::uint64_t near_flipped(PlaneCell tile) const;
  std::vector<std::uint64_t> tiles_to_look_at() const;

  tsl::robin_map<std::uint64_t, Tile, PackedKeyHash> tiles_;
  std::vector<std::uint64_t> dirty_;
};

}  // namespace octosurf::geometry
