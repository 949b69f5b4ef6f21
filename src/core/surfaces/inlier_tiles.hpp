#pragma once

#include "geometry/cell_bits.hpp"
#include "geometry/voxel_key.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::surfaces {

/// A voxel that belongs to a surface, with its point as in the octree.
struct Inlier {
  geometry::VoxelKey key;
  std::uint8_t range_class = 0;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
};

/// A surface's inliers by cell of its plane. Those of a tile of 8 × 8 cells are contiguous, in order of their
/// cells, so a scan, which sees a part of a surface, touches few memory locations however large the surface
/// is: 20 bytes an inlier, at most twice that while a tile grows.
class InlierTiles {
 public:
  /// O(inliers of a tile), as remove().
  void add(geometry::PlaneCell cell, const Inlier& inlier);

  struct Removed {
    Inlier inlier;
    bool cell_empty = false;  ///< it was the last inlier of its cell
  };
  /// None if there is no such inlier in that cell.
  std::optional<Removed> remove(geometry::PlaneCell cell, geometry::VoxelKey key);

  void clear() { tiles_.clear(); }

  /// Those of one cell, in order of insertion.
  template <class Visit>
  void for_each_in(geometry::PlaneCell cell, Visit&& visit) const {
    const auto tile = tiles_.find(geometry::CellBits::tile_of(cell).packed());
    if (tile == tiles_.end()) return;
    const auto bit = static_cast<std::uint8_t>(geometry::CellBits::bit_of(cell));
    const std::vector<Placed>& all = tile->second.inliers;
    for (std::size_t i = tile->second.first_from(bit); i < all.size() && all[i].cell == bit; ++i)
      visit(all[i].inlier());
  }
  /// All, in no particular order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& tile : tiles_)
      for (const Placed& placed : tile.second.inliers) visit(placed.inlier());
  }

 private:
  /// An Inlier with its cell of the tile in the padding.
  struct Placed {
    geometry::VoxelKey key;
    std::uint8_t range_class, cell;
    Eigen::Vector3f position;
    Inlier inlier() const { return {key, range_class, position}; }
  };
  struct Tile {
    std::uint64_t occupied = 0;
    std::vector<Placed> inliers;  // by cell

    /// Index of the first inlier in this cell or a later one.
    std::size_t first_from(std::uint8_t cell) const;
  };

  tsl::robin_map<std::uint64_t, Tile, geometry::PackedKeyHash> tiles_;
};

}  // namespace octosurf::surfaces
