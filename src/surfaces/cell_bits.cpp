#include "surfaces/cell_bits.hpp"

#include <algorithm>
#include <array>

namespace octosurf {

bool CellBits::change(PlaneCell cell, bool occupied) {
  const std::uint64_t key = tile_of(cell).packed(), bit = std::uint64_t{1} << bit_of(cell);
  Tile& tile = tiles_.try_emplace(key).first.value();
  const bool was = (tile.occupied & bit) != 0;
  if (was && occupied && (tile.deep & bit) != 0) return false;
  tile.occupied = occupied ? tile.occupied | bit : tile.occupied & ~bit;
  if (tile.changed == 0) dirty_.push_back(key);
  tile.changed |= bit;
  return true;
}

void CellBits::change_all() {
  dirty_.clear();
  for (auto tile = tiles_.begin(); tile != tiles_.end(); ++tile) {
    tile.value() = {tile->second.occupied, 0, 0, tile->second.occupied | tile->second.settled};
    dirty_.push_back(tile->first);
  }
}

void CellBits::clear() {
  tiles_.clear();
  dirty_.clear();
}

/// Cells of a tile all of whose neighbours within two are occupied.
std::uint64_t CellBits::eroded(PlaneCell at) const {
  std::array<std::array<std::uint64_t, 3>, 3> around{};
  for (int v = 0; v < 3; ++v)
    for (int u = 0; u < 3; ++u)
      if (const auto tile = tiles_.find(PlaneCell{at.u + u - 1, at.v + v - 1}.packed()); tile != tiles_.end())
        around[v][u] = tile->second.occupied;
  // Rows −2 … 9, each eroded along u first: bit u says that cells u−2 … u+2 are occupied.
  std::array<std::uint64_t, 12> rows{};
  for (int row = 0; row < 12; ++row) {
    const auto& tiles = around[(row + 6) / 8];
    const int shift = (row + 6) % 8 * 8;
    const std::uint64_t cells =
        (tiles[0] >> shift & 0xff) >> 6 | (tiles[1] >> shift & 0xff) << 2 | (tiles[2] >> shift & 0x03) << 10;
    rows[row] = cells & cells >> 1 & cells >> 2 & cells >> 3 & cells >> 4 & 0xff;
  }
  std::uint64_t deep = 0;
  for (int v = 0; v < 8; ++v)
    deep |= (rows[v] & rows[v + 1] & rows[v + 2] & rows[v + 3] & rows[v + 4]) << 8 * v;
  return deep;
}

/// Those with changes, and their neighbours where a cell within two of them came or went.
std::vector<std::uint64_t> CellBits::tiles_to_look_at() const {
  constexpr std::uint64_t low_u = 0x0303030303030303, high_u = 0xc0c0c0c0c0c0c0c0;
  constexpr std::uint64_t low_v = 0x000000000000ffff, high_v = 0xffff000000000000, all = ~std::uint64_t{0};
  std::vector<std::uint64_t> keys;
  for (const std::uint64_t key : dirty_) {
    const Tile& tile = tiles_.find(key)->second;
    const PlaneCell at = PlaneCell::unpack(key);
    const std::uint64_t flipped = tile.occupied ^ tile.settled;
    for (int v = -1; v <= 1; ++v)
      for (int u = -1; u <= 1; ++u) {
        const std::uint64_t side = (u < 0   ? low_u
                                    : u > 0 ? high_u
                                            : all) &
                                   (v < 0   ? low_v
                                    : v > 0 ? high_v
                                            : all);
        if ((u == 0 && v == 0) || (flipped & side) != 0)
          keys.push_back(PlaneCell{at.u + u, at.v + v}.packed());
      }
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

std::vector<CellBits::Cells> CellBits::settle(bool thin) {
  std::vector<Cells> changed;
  for (const std::uint64_t key : tiles_to_look_at()) {
    const auto found = tiles_.find(key);
    if (found == tiles_.end()) continue;
    Tile& tile = found.value();
    const std::uint64_t deep = thin ? eroded(PlaneCell::unpack(key)) : 0;
    const std::uint64_t cells = (tile.changed & ~(tile.deep & deep)) | (tile.deep ^ deep);
    if (cells != 0) changed.push_back({PlaneCell::unpack(key), cells});
    tile.deep = deep;
  }
  for (const std::uint64_t key : dirty_) {
    const auto found = tiles_.find(key);
    Tile& tile = found.value();
    tile.settled = tile.occupied;
    tile.changed = 0;
    if (tile.occupied == 0) tiles_.erase(found);
  }
  dirty_.clear();
  return changed;
}

}  // namespace octosurf
