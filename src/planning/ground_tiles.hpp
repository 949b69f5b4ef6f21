#pragma once

#include "planning/cell_raster.hpp"
#include "planning/cell_runs.hpp"
#include "planning/column.hpp"
#include "planning/made_once.hpp"

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/gaps.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The ground of one surface (gaps.hpp), tile by tile of its plane: squares of 64 voxels, or all in one if
/// bridged gaps are so wide that most of a tile would depend on its neighbours. A tile is computed at its
/// first read, from the outline and the octree near it and the plane, rounded so that a refit seldom changes
/// it. A later snapshot shares the tiles near which nothing changed. Readable from any thread.
class GroundTiles {
 public:
  /// `d`: of the octree.
  GroundTiles(SurfacePtr surface, double d, double widest_bridged_m);
  /// The same surface later, or another version of it. `changed`: the cubes of the octree that changed since.
  GroundTiles(const GroundTiles& before, SurfacePtr surface, std::span<const Eigen::AlignedBox3d> changed);

  const Surface& surface() const { return *surface_; }
  /// Whether the earlier version's ground is this one's, too.
  bool same_as_before() const { return same_; }

  /// The surface with the outline of its ground. `octree`: of this version.
  SurfacePtr solid(const OccupancyView& octree) const;
  const std::vector<Gap>& gaps(const OccupancyView& octree) const;
  /// Of a place within the outline or its holes; empty beyond.
  std::optional<Ground> ground_at(const Eigen::Vector2d& uv, const OccupancyView& octree) const;
  /// Calls `visit(uv, Ground)` at places in a grid, at most so far apart, within the outline and its holes.
  template <class Visit>
  void for_each_place(const OccupancyView& octree, double apart, const Visit& visit) const {
    const auto per_cell = static_cast<int>(std::ceil(d_ / apart));
    for (const Key& key : keys_in(outline_->box())) {
      const Tile& one = tile(key, octree);
      for (std::size_t i = 0; i < one.of.size(); ++i)
        if (const std::optional<Ground> kind = ground_of(one.of[i]))
          for (int k = 0; k < per_cell * per_cell; ++k)
            visit(one.cells.middle(i) +
                      d_ * ((Eigen::Array2d(k % per_cell, k / per_cell) + 0.5) / per_cell - 0.5).matrix(),
                  *kind);
    }
  }
  /// The ground's outline clipped to a box, whose sides count as edges. O(vertices of the surface), some ns
  /// each, and the tiles there.
  std::vector<Polygon> solid_within(const Eigen::AlignedBox2d& box, const OccupancyView& octree,
                                    bool as_mapped) const;

 private:
  using Key = std::array<int, 2>;
  struct Tile {
    CellRaster cells;            ///< of edge d, the tile's own
    Mask of;                     ///< each: its Ground, and bits; empty if nothing of the outline is near
    std::vector<Ring2> bridged;  ///< rectangles that cover the bridged cells, and a cell more
    std::vector<Ring2> voids;    ///< rectangles
  };
  struct Cuts {
    std::vector<Ring2> bridged, voids;  // of some tiles
  };
  class Finder;  // ground_tile.cpp
  static constexpr std::uint8_t ground_bits = 3, bridged_bit = 4, inside_bit = 8, beyond_bit = 16;

  static std::optional<Ground> ground_of(std::uint8_t of);
  bool whole() const;        // all in one tile
  int widest_cells() const;  // radius of the widest disc that is bridged
  GroundPlane plane_at(const Key& key) const;
  CellRaster cells_of(const Key& key) const;
  CellRaster cells_about(const CellRaster& cells, int more, int margin) const;
  Key key_at(const Eigen::Vector2d& uv) const;
  std::vector<Key> keys_in(const Eigen::AlignedBox2d& box) const;  // row by row
  Cuts cuts_in(const Eigen::AlignedBox2d& box, const OccupancyView& octree) const;
  const Tile& tile(const Key& key, const OccupancyView& octree) const;
  std::vector<Gap> find_gaps(const OccupancyView& octree) const;
  std::vector<Polygon> reshape(const std::vector<Polygon>& polygons, const Cuts& cuts) const;

  SurfacePtr surface_;
  double d_, widest_bridged_m_;
  int halo_ = 0;                             // cells about a tile on which it depends
  std::shared_ptr<const CellRuns> outline_;  // in cells of d/2
  Eigen::AlignedBox3d reach_;
  bool same_ = false;
  mutable MadeOnce<Key, Tile> tiles_;
  mutable MadeOnce<int, SurfacePtr> solid_;
  mutable MadeOnce<int, std::vector<Gap>> gaps_;
};

}  // namespace octosurf::planning
