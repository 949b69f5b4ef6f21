#include "geometry/interruption.hpp"
#include "planning/ground_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::planning {

/// Computes a tile from its cells and those about it.
class GroundTiles::Finder {
 public:
  Finder(const GroundTiles& tiles, const Key& key, const OccupancyView& octree)
      : plane_(tiles.plane_at(key)),
        octree_(octree),
        d_(tiles.d_),
        own_(tiles.cells_about(tiles.cells_of(key), 0, 2)),
        // A void's disc of 8 voxels at most, with the readings that bound it, may reach beyond the outline.
        raster_(tiles.cells_about(own_, tiles.halo_, std::max(12, tiles.widest_cells() + 2))),
        fine_(2 * raster_.low(), 2 * raster_.high(), d_ / 2),
        widest_radius_(std::min(widest_gap_m, tiles.widest_bridged_m_) / 2 / d_) {
    fine_inside_.assign(fine_.cells(), 0);
    Mask fine_filled = fine_inside_;
    tiles.outline_->mark(fine_, false, fine_inside_);
    tiles.outline_->mark(fine_, true, fine_filled);
    inside_ = coarse(fine_inside_);
    about_ = coarse(fine_filled);
  }

  Tile find() {
    Tile tile{own_, {}, {}, {}};
    if (own_.cells() == 0 || !any(about_)) return tile;
    const Columns columns(octree_, plane_, raster_.box());
    look(columns);
    settle_open();
    find_voids(columns, tile);
    bridge();
    find_holes(tile);
    tile.bridged = raster_.rows(own_marked(raster_, bridged_, 1), 1);
    tile.of.resize(own_.cells());
    for (std::size_t i = 0; i < tile.of.size(); ++i)
      tile.of[i] = described(raster_.index_of(own_.place_of(i)));
    return tile;
  }

 private:
  /// Cells of d of which half is marked.
  Mask coarse(const Mask& fine) const {
    Mask result(raster_.cells(), 0);
    const std::size_t width = fine_.width();
    for (std::size_t i = 0; i < result.size(); ++i) {
      const std::size_t first = i / (width / 2) * 2 * width + i % (width / 2) * 2;
      result[i] = fine[first] + fine[first + 1] + fine[first + width] + fine[first + width + 1] >= 2;
    }
    return result;
  }
  /// The marked cells of the tile itself, of one of both rasters, of which a cell has `per` to a voxel.
  std::vector<std::size_t> own_marked(const CellRaster& raster, const Mask& mask, int per) const {
    std::vector<std::size_t> cells;
    const Eigen::Vector2i low = per * own_.low(), end = per * own_.high();
    for (int y = low.y(); y < end.y(); ++y)
      for (int x = low.x(); x < end.x(); ++x)
        if (const std::size_t i = raster.index_of({x, y}); mask[i] != 0) cells.push_back(i);
    return cells;
  }

  void look(const Columns& columns) {
    if (widest_radius_ >= 1) {  // between parts of the surface, too
      const Mask closed = raster_.closed(inside_, widest_radius_);
      for (std::size_t i = 0; i < about_.size(); ++i) about_[i] |= closed[i];
    }
    const std::size_t n = raster_.cells();
    reading_.assign(n, 0);
    free_ = open_ = blocked_ = passed_ = reading_;
    raster_.for_each_in(raster_.box(), [&](std::size_t i, const Eigen::Vector2d& middle) {
      if (about_[i] == 0) return;
      const Columns::Seen seen = columns.at(middle);
      reading_[i] = seen.reading;
      free_[i] = seen.free;
      open_[i] = seen.open;
      blocked_[i] = seen.blocked;
      passed_[i] = seen.passed;
    });
  }

  /// Dilates voids into neighbouring cells that are free on the plane, then removes those one cell wide.
  void settle_open() {
    if (!any(open_)) return;
    for (int k = 0; k < plane_.aside(); ++k) {
      const Mask near = raster_.near(open_, 1);
      for (std::size_t i = 0; i < near.size(); ++i)
        if (near[i] != 0 && free_[i] != 0 && about_[i] != 0) open_[i] = 1;
    }
    open_ = raster_.two_wide(open_);
  }

  /// Adds voids that the outline spans.
  void find_voids(const Columns& columns, Tile& tile) {
    Mask spanned(fine_.cells(), 0);
    mark_voids(plane_, octree_, columns, fine_, fine_inside_, spanned);
    tile.voids = raster_.rows(own_marked(raster_, open_, 1));
    for (Ring2& row : fine_.rows(own_marked(fine_, spanned, 2))) tile.voids.push_back(std::move(row));
    for (const std::size_t i : fine_.marked(spanned))
      raster_.for_each_within(fine_.middle(i), d_ / 2, [&](std::size_t cell) { open_[cell] = 1; });
  }

  /// Decides for each unseen cell by the widest disc that holds it within its gap.
  void bridge() {
    const std::size_t n = raster_.cells();
    bridged_.assign(n, 0);
    void_ = open_;
    Mask gap(n, 0);
    for (std::size_t i = 0; i < n; ++i) gap[i] = about_[i] != 0 && inside_[i] == 0;
    if (!any(gap) || (widest_radius_ < 1 && !any(open_))) return;
    const Mask beside_open = raster_.near(open_, 2);
    if (widest_radius_ >= 1) bridge(gap, beside_open);
    // Unseen cells beside a void are part of it.
    for (std::size_t i = 0; i < n; ++i)
      if (gap[i] != 0 && bridged_[i] == 0 && reading_[i] == 0 && blocked_[i] == 0 && beside_open[i] != 0)
        void_[i] = 1;
  }

  void bridge(const Mask& gap, const Mask& beside_open) {
    const std::size_t n = raster_.cells();
    const Mask beside_blocked = raster_.near(blocked_, 2);
    // Cells that fit no disc of a cell's radius are rounding of the outline, and join their neighbours.
    for (std::size_t i = 0; i < n; ++i)
      bridged_[i] = gap[i] != 0 && beside_open[i] == 0 && beside_blocked[i] == 0;
    Mask empty = gap, obstacle = open_;
    for (std::size_t i = 0; i < n; ++i) {
      empty[i] = gap[i] != 0 && reading_[i] == 0;
      obstacle[i] |= blocked_[i];
    }
    Spacing spacing(*this, empty);
    for (double radius = 1; radius <= widest_radius_ * widening; radius *= widening) {
      const Mask core = raster_.eroded(gap, radius);
      if (!any(core)) break;
      // Discs that meet a void, or something that stands there.
      Mask spoiled = raster_.near(obstacle, radius + 1);
      for (std::size_t i = 0; i < n; ++i) spoiled[i] &= core[i];
      const Mask in_disc = raster_.covered(core, radius), in_spoiled = raster_.covered(spoiled, radius);
      spacing.of_discs(radius);
      for (std::size_t i = 0; i < n; ++i)
        if (in_disc[i] != 0)
          bridged_[i] =
              radius <= widest_radius_ && in_spoiled[i] == 0 && blocked_[i] == 0 && spacing.explains(i);
    }
  }

  /// Cuts empty cells inside the outline that the spacing of the readings does not explain.
  void find_holes(Tile& tile) {
    const std::size_t n = raster_.cells();
    hole_.assign(n, 0);
    Mask empty(n, 0);
    for (std::size_t i = 0; i < n; ++i)
      empty[i] = inside_[i] != 0 && reading_[i] == 0 && void_[i] == 0 && bridged_[i] == 0;
    empty = raster_.two_wide(empty);
    if (!any(empty)) return;
    std::optional<Spacing> spacing;
    // Cells: discs as wide as an outline closes gaps, h of five voxels; what they depend on lies in the halo.
    for (const double radius : {1.0, widening, 2.0, 3.0}) {
      Mask core = raster_.eroded(empty, radius);
      if (!any(core)) break;
      if (!spacing) spacing.emplace(*this, empty);
      spacing->of_discs(radius);
      for (std::size_t i = 0; i < n; ++i) core[i] = core[i] != 0 && !spacing->explains(i);
      const Mask in_disc = raster_.covered(core, radius);
      for (std::size_t i = 0; i < n; ++i) hole_[i] |= in_disc[i];
    }
    for (Ring2& row : raster_.rows(own_marked(raster_, hole_, 1))) tile.voids.push_back(std::move(row));
  }

  /// Whether readings are spaced so that discs of some size hold none.
  class Spacing {
   public:
    /// `empty`: the cells in question.
    Spacing(const Finder& finder, const Mask& empty)
        : finder_(finder),
          readings_(finder.raster_.summed(finder.reading_)),
          about_(finder.raster_.summed(finder.about_)),
          empty_(finder.raster_.summed(empty)),
          inside_(finder.raster_.summed(finder.inside_)) {
      Mask passed = empty;
      for (std::size_t i = 0; i < passed.size(); ++i) passed[i] = empty[i] != 0 && finder.passed_[i] != 0;
      passed_ = finder.raster_.summed(passed);
    }
    void of_discs(double radius) {
      radius_ = radius;
      solid_ = finder_.raster_.summed(finder_.raster_.opened(finder_.reading_, radius));
    }
    /// Of a disc about a cell.
    bool explains(std::size_t i) const {
      const CellRaster& raster = finder_.raster_;
      const int wide = static_cast<int>(std::ceil(radius_)),
                around = static_cast<int>(std::ceil(3 * radius_)) + 1;
      if (2 * raster.sum(solid_, i, around) < raster.sum(inside_, i, around)) return true;  // between lines
      // Of one cell more than there are: a share of 1 has no logarithm.
      const double read = raster.sum(readings_, i, around), all = raster.sum(about_, i, around);
      return -std::log1p(-read / (all + 1)) * std::numbers::pi * radius_ * radius_ < rarest &&
             raster.sum(passed_, i, wide) >= most * raster.sum(empty_, i, wide);
    }

   private:
    const Finder& finder_;
    std::vector<std::int32_t> readings_, about_, empty_, passed_, inside_, solid_;
    double radius_ = 0;
  };

  std::uint8_t described(std::size_t i) const {
    if (about_[i] == 0) return beyond_bit;
    Ground ground = Ground::supported;
    if (void_[i] != 0)
      ground = Ground::open;
    else if (inside_[i] == 0 || hole_[i] != 0)
      ground = blocked_[i] != 0 ? Ground::blocked : Ground::unseen;
    return static_cast<std::uint8_t>(static_cast<unsigned>(ground) | (bridged_[i] != 0 ? bridged_bit : 0U) |
                                     (inside_[i] != 0 ? inside_bit : 0U));
  }

  static bool any(const Mask& mask) { return std::find(mask.begin(), mask.end(), 1) != mask.end(); }

  static constexpr double widening = 1.25;  // from disc to disc
  // Nats: random readings leave a disc empty in one of 10⁴ places, the number of places searched for gaps, as
  // for planes (docs/detection.md).
  static constexpr double rarest = 9;
  // Of a gap's voxels before the plane, which rays that pass in steps of d may miss here and there.
  static constexpr double most = 0.75;

  GroundPlane plane_;
  const OccupancyView& octree_;
  double d_;
  CellRaster own_, raster_, fine_;
  double widest_radius_;  // cells, of a bridged gap
  Mask fine_inside_;
  Mask inside_, about_, reading_, free_, open_, blocked_, passed_, bridged_, void_, hole_;
};

const GroundTiles::Tile& GroundTiles::tile(const Key& key, const OccupancyView& octree) const {
  geometry::end_if_interrupted();
  return tiles_.get(key, [&] { return Finder(*this, key, octree).find(); });
}

}  // namespace octosurf::planning
