#include "geometry/cell_bits.hpp"

#include <algorithm>

namespace octosurf::geometry {

std::uint32_t CellBits::around(PlaneCell cell) const {
  const PlaneCell first = tile_of({cell.u - 2, cell.v - 2}), last = tile_of({cell.u + 2, cell.v + 2});
  std::array<std::array<std::uint64_t, 2>, 2> tiles{};
  for (int v = first.v; v <= last.v; ++v)
    for (int u = first.u; u <= last.u; ++u)
      if (const auto tile = tiles_.find(PlaneCell{u, v}.packed()); tile != tiles_.end())
        tiles[v - first.v][u - first.u] = tile->second.occupied;
  std::uint32_t around = 0;
  for (int v = 0; v < 5; ++v) {
    const int row = cell.v - 2 + v;
    const auto& side = tiles[(row >> 3) - first.v];
    const std::uint64_t cells = (side[0] >> (row & 7) * 8 & 0xff) | (side[1] >> (row & 7) * 8 & 0xff) << 8;
    around |= static_cast<std::uint32_t>(cells >> ((cell.u - 2) & 7) & 0x1f) << 5 * v;
  }
  return around;
}

void CellBits::rows_from(PlaneCell first, int columns, std::span<std::uint64_t> rows) const {
  std::fill(rows.begin(), rows.end(), 0);
  const int end = first.v + static_cast<int>(rows.size());
  const PlaneCell last = tile_of({first.u + columns - 1, end - 1});
  for (int tv = first.v >> 3; tv <= last.v; ++tv)
    for (int tu = first.u >> 3; tu <= last.u; ++tu) {
      const auto tile = tiles_.find(PlaneCell{tu, tv}.packed());
      if (tile == tiles_.end()) continue;
      const int shift = 8 * tu - first.u;
      for (int v = std::max(8 * tv, first.v); v < std::min(8 * tv + 8, end); ++v) {
        const std::uint64_t row = tile->second.occupied >> (v & 7) * 8 & 0xff;
        rows[static_cast<std::size_t>(v - first.v)] |= shift < 0 ? row >> -shift : row << shift;
      }
    }
  for (std::uint64_t& row : rows) row &= ~std::uint64_t{0} >> (64 - columns);
}

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
    tile.value() = {tile->second.occupied, 0, 0, tile->second.occupied | tile->second.taken};
    dirty_.push_back(tile->first);
  }
}

void CellBits::clear() {
  tiles_.clear();
  dirty_.clear();
}

/// Rows −2 … 9 of a tile, twelve cells each: bit u is cell u − 2 of the tile.
template <class Select>
CellBits::Rows CellBits::rows_about(PlaneCell at, Select&& bits_of) const {
  std::array<std::array<std::uint64_t, 3>, 3> around{};
  for (int v = 0; v < 3; ++v)
    for (int u = 0; u < 3; ++u)
      if (const auto tile = tiles_.find(PlaneCell{at.u + u - 1, at.v + v - 1}.packed()); tile != tiles_.end())
        around[v][u] = bits_of(tile->second);
  Rows rows{};
  for (int row = 0; row < 12; ++row) {
    const auto& tiles = around[(row + 6) / 8];
    const int shift = (row + 6) % 8 * 8;
    rows[row] =
        (tiles[0] >> shift & 0xff) >> 6 | (tiles[1] >> shift & 0xff) << 2 | (tiles[2] >> shift & 0x03) << 10;
  }
  return rows;
}

/// Cells of a tile all of whose neighbours within two are occupied.
std::uint64_t CellBits::eroded(PlaneCell at) const {
  Rows rows = rows_about(at, [](const Tile& tile) { return tile.occupied; });
  for (std::uint64_t& row : rows) row &= row >> 1 & row >> 2 & row >> 3 & row >> 4 & 0xff;
  std::uint64_t deep = 0;
  for (int v = 0; v < 8; ++v)
    deep |= (rows[v] & rows[v + 1] & rows[v + 2] & rows[v + 3] & rows[v + 4]) << 8 * v;
  return deep;
}

/// Cells of a tile with a neighbour within two whose occupancy changed since the last take_changes().
std::uint64_t CellBits::near_flipped(PlaneCell at) const {
  Rows rows = rows_about(at, [](const Tile& tile) { return tile.occupied ^ tile.taken; });
  for (std::uint64_t& row : rows) row = (row | row >> 1 | row >> 2 | row >> 3 | row >> 4) & 0xff;
  std::uint64_t near = 0;
  for (int v = 0; v < 8; ++v)
    near |= (rows[v] | rows[v + 1] | rows[v + 2] | rows[v + 3] | rows[v + 4]) << 8 * v;
  return near;
}

/// Tiles with changes, and their neighbours if a cell within two of them changed.
std::vector<std::uint64_t> CellBits::tiles_to_look_at() const {
  constexpr std::uint64_t low_u = 0x0303030303030303, high_u = 0xc0c0c0c0c0c0c0c0;
  constexpr std::uint64_t low_v = 0x000000000000ffff, high_v = 0xffff000000000000, all = ~std::uint64_t{0};
  std::vector<std::uint64_t> keys;
  for (const std::uint64_t key : dirty_) {
    const Tile& tile = tiles_.find(key)->second;
    const PlaneCell at = PlaneCell::unpack(key);
    const std::uint64_t flipped = tile.occupied ^ tile.taken;
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

std::vector<CellBits::Cells> CellBits::take_changes(bool thin) {
  std::vector<Cells> changed;
  for (const std::uint64_t key : tiles_to_look_at()) {
    const auto found = tiles_.find(key);
    if (found == tiles_.end()) continue;
    Tile& tile = found.value();
    const std::uint64_t deep = thin ? eroded(PlaneCell::unpack(key)) : 0;
    const std::uint64_t boundary = near_flipped(PlaneCell::unpack(key)) & tile.occupied & ~deep;
    const std::uint64_t cells = (tile.changed & ~(tile.deep & deep)) | (tile.deep ^ deep) | boundary;
    if (cells != 0) changed.push_back({PlaneCell::unpack(key), cells});
    tile.deep = deep;
  }
  for (const std::uint64_t key : dirty_) {
    const auto found = tiles_.find(key);
    Tile& tile = found.value();
    tile.taken = tile.occupied;
    tile.changed = 0;
    if (tile.occupied == 0) tiles_.erase(found);
  }
  dirty_.clear();
  return changed;
}

Eigen::AlignedBox2d CellBits::Cells::box() const {
  std::uint64_t columns = bits;
  for (const int half : {32, 16, 8}) columns |= columns >> half;
  const auto across = static_cast<std::uint8_t>(columns);
  const Eigen::Vector2d corner(8.0 * tile.u, 8.0 * tile.v);
  return {corner + Eigen::Vector2d(std::countr_zero(across), std::countr_zero(bits) / 8),
          corner + Eigen::Vector2d(8 - std::countl_zero(across), 8 - std::countl_zero(bits) / 8)};
}

std::vector<CellBits::Cells> CellBits::boundary() const {
  std::vector<Cells> boundary;
  for (const auto& [key, tile] : tiles_)
    if (const std::uint64_t cells = tile.taken & ~tile.deep; cells != 0)
      boundary.push_back({PlaneCell::unpack(key), cells});
  return boundary;
}

}  // namespace octosurf::geometry
