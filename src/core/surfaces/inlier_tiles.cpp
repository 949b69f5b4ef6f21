#include "surfaces/inlier_tiles.hpp"

#include <bit>

namespace octosurf::surfaces {

std::size_t InlierTiles::Tile::first_from(std::uint8_t cell) const {
  // Start of the search: every occupied cell before it has one inlier, rarely more.
  const std::uint64_t before = (std::uint64_t{1} << cell) - 1;
  auto i = static_cast<std::size_t>(std::popcount(occupied & before));
  while (i < inliers.size() && inliers[i].cell < cell) ++i;
  return i;
}

void InlierTiles::add(geometry::PlaneCell cell, const Inlier& inlier) {
  Tile& tile = tiles_[geometry::CellBits::tile_of(cell).packed()];
  const auto bit = static_cast<std::uint8_t>(geometry::CellBits::bit_of(cell));
  std::size_t at = tile.first_from(bit);
  while (at < tile.inliers.size() && tile.inliers[at].cell == bit) ++at;
  tile.inliers.insert(tile.inliers.begin() + static_cast<std::ptrdiff_t>(at),
                      {inlier.key, inlier.range_class, bit, inlier.position});
  tile.occupied |= std::uint64_t{1} << bit;
}

std::optional<InlierTiles::Removed> InlierTiles::remove(geometry::PlaneCell cell, geometry::VoxelKey key) {
  const auto found = tiles_.find(geometry::CellBits::tile_of(cell).packed());
  if (found == tiles_.end()) return {};
  Tile& tile = found.value();
  const auto bit = static_cast<std::uint8_t>(geometry::CellBits::bit_of(cell));
  const std::size_t first = tile.first_from(bit);
  std::size_t end = first, at = tile.inliers.size();
  for (; end < tile.inliers.size() && tile.inliers[end].cell == bit; ++end)
    if (tile.inliers[end].key == key) at = end;
  if (at == tile.inliers.size()) return {};
  const Removed removed{tile.inliers[at].inlier(), end - first == 1};
  tile.inliers.erase(tile.inliers.begin() + static_cast<std::ptrdiff_t>(at));
  if (removed.cell_empty) tile.occupied &= ~(std::uint64_t{1} << bit);
  if (tile.inliers.empty()) tiles_.erase(found);
  return removed;
}

}  // namespace octosurf::surfaces
