#include "planning/ground_tiles.hpp"

#include "geometry/interruption.hpp"
#include "geometry/rings.hpp"
#include "planning/blocked_polygon.hpp"
#include "planning/rings.hpp"
#include "planning/voids.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

namespace octosurf::planning {
namespace {

constexpr int tile_bits = 6, tile_edge = 1 << tile_bits;  // cells
/// Cells: where a tile depends on more about it, all is one tile.
constexpr int widest_halo = tile_edge / 2;
/// Steps to which a tile's plane is rounded: a sixteenth of a voxel, and as much at a tile's end.
constexpr double steps_per_voxel = 16, steps_per_radian = 512;

// Of each cell, besides its Ground.
constexpr std::uint8_t ground_bits = 3, bridged_bit = 4, inside_bit = 8, beyond_bit = 16;

}  // namespace

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
        fine_(2 * raster_.low(), 2 * (raster_.low() + Eigen::Vector2i(raster_.width(), raster_.height())),
              d_ / 2),
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
    for (std::size_t i = 0; i < tile.of.size(); ++i) tile.of[i] = described(cell_of_own(i));
    return tile;
  }

 private:
  /// Cells of d of which half is marked.
  Mask coarse(const Mask& fine) const {
    Mask result(raster_.cells(), 0);
    const auto width = static_cast<std::size_t>(fine_.width());
    for (std::size_t i = 0; i < result.size(); ++i) {
      const std::size_t first = i / (width / 2) * 2 * width + i % (width / 2) * 2;
      result[i] = fine[first] + fine[first + 1] + fine[first + width] + fine[first + width + 1] >= 2;
    }
    return result;
  }
  std::size_t cell_of_own(std::size_t own) const {
    const auto width = static_cast<std::size_t>(own_.width());
    const Eigen::Matrix<std::size_t, 2, 1> before = (own_.low() - raster_.low()).cast<std::size_t>();
    return (own / width + before.y()) * static_cast<std::size_t>(raster_.width()) + own % width + before.x();
  }
  /// The marked cells of the tile itself, of one of both rasters, of which a cell has `per` to a voxel.
  std::vector<std::size_t> own_marked(const CellRaster& raster, const Mask& mask, int per) const {
    std::vector<std::size_t> cells;
    const Eigen::Vector2i low = per * (own_.low() - raster_.low());
    for (int y = low.y(); y < low.y() + per * own_.height(); ++y)
      for (int x = low.x(); x < low.x() + per * own_.width(); ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(raster.width()) +
                              static_cast<std::size_t>(x);
        if (mask[i] != 0) cells.push_back(i);
      }
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
      const bool between_lines = 2 * raster.sum(solid_, i, around) < raster.sum(inside_, i, around);
      if (between_lines) return true;
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

GroundTiles::GroundTiles(SurfacePtr surface, double d, double widest_bridged_m)
    : surface_(std::move(surface)),
      d_(d),
      widest_bridged_m_(widest_bridged_m),
      outline_(std::make_shared<CellRuns>(surface_->polygons, d / 2)) {
  const double radius = std::min(widest_gap_m, widest_bridged_m) / 2 / d;
  GroundPlane plane{surface_->id, d, surface_->rms_m, {}};
  halo_ = static_cast<int>(std::max(void_reach, plane.aside() + 3.0));
  // A closing takes two radii, the discs of a quarter more about it and what they are compared with the rest.
  if (radius >= 1) halo_ += static_cast<int>(std::ceil(6.25 * radius));
  const Eigen::AlignedBox2d box = outline_->box();
  if (box.isEmpty()) return;
  const double aside = (halo_ + slanted_reach + tile_edge / 4) * d, up = plane.depth() + 4 * d;
  for (const double u : {box.min().x() - aside, box.max().x() + aside})
    for (const double v : {box.min().y() - aside, box.max().y() + aside})
      for (const double height : {-deepest_evidence * d - up, up})
        reach_.extend(surface_->T_map_surface * Eigen::Vector3d(u, v, height));
}

GroundTiles::GroundTiles(const GroundTiles& before, SurfacePtr surface,
                         std::span<const Eigen::AlignedBox3d> changed)
    : GroundTiles(std::move(surface), before.d_, before.widest_bridged_m_) {
  if (before.whole() || whole()) {
    same_ = surface_ == before.surface_ &&
            std::none_of(changed.begin(), changed.end(),
                         [&](const auto& cube) { return reach_.intersects(cube); });
  } else {
    const std::vector<Key> keys = keys_in(outline_->box());
    const Key low = keys.empty() ? Key{0, 0} : keys.front(), high = keys.empty() ? Key{-1, -1} : keys.back();
    Mask stale(keys.size(), 0);
    const auto index = [&](const Key& key) {
      return static_cast<std::size_t>(key[1] - low[1]) * static_cast<std::size_t>(high[0] - low[0] + 1) +
             static_cast<std::size_t>(key[0] - low[0]);
    };
    const auto add = [&](const Eigen::AlignedBox2d& box, double margin) {
      const Key from = key_at(box.min().array() - margin * d_), to = key_at(box.max().array() + margin * d_);
      for (int y = std::max(low[1], from[1]); y <= std::min(high[1], to[1]); ++y)
        for (int x = std::max(low[0], from[0]); x <= std::min(high[0], to[0]); ++x) stale[index({x, y})] = 1;
    };
    if (surface_ != before.surface_)
      outline_->for_each_difference(
          *before.outline_, [&](std::int64_t row, std::int64_t from, std::int64_t to) {
            const double half = d_ / 2;
            const Eigen::Vector2d first(static_cast<double>(from), static_cast<double>(row)),
                last(static_cast<double>(to), static_cast<double>(row + 1));
            add({half * first, half * last}, halo_ + 1);
          });
    const Eigen::Isometry3d T_surface_map = surface_->T_map_surface.inverse();
    const double up = GroundPlane{0, d_, surface_->rms_m, {}}.depth() + 4 * d_;
    for (const Eigen::AlignedBox3d& cube : changed) {
      if (!reach_.intersects(cube)) continue;
      const Eigen::Vector3d middle = T_surface_map * cube.center();
      const double around = cube.diagonal().norm() / 2, above = middle.z() - around,
                   below = middle.z() + around;
      if (above > up || below < -deepest_evidence * d_ - up) continue;
      add(Eigen::AlignedBox2d(middle.head<2>()), halo_ + 2 + around / d_ + (above < -up ? slanted_reach : 0));
    }
    tiles_.share(before.tiles_, [&](const Key& key) {
      return std::binary_search(
                 keys.begin(), keys.end(), key,
                 [](const Key& a, const Key& b) { return std::pair(a[1], a[0]) < std::pair(b[1], b[0]); }) &&
             stale[index(key)] == 0 && plane_at(key) == before.plane_at(key);
    });
    same_ = surface_ == before.surface_ && std::find(stale.begin(), stale.end(), 1) == stale.end();
  }
  if (!same_) return;
  if (whole()) tiles_.share(before.tiles_, [](const Key&) { return true; });
  solid_.share(before.solid_, [](int) { return true; });
  gaps_.share(before.gaps_, [](int) { return true; });
}

int GroundTiles::widest_cells() const {
  return static_cast<int>(std::ceil(std::min(widest_gap_m, widest_bridged_m_) / 2 / d_));
}

bool GroundTiles::whole() const { return halo_ > widest_halo; }

/// Rounded, unless all is one tile.
GroundPlane GroundTiles::plane_at(const Key& key) const {
  GroundPlane plane{surface_->id, d_, surface_->rms_m, surface_->T_map_surface};
  if (whole()) return plane;
  const double step = d_ / steps_per_voxel;
  const auto rounded = [](const Eigen::Vector3d& x, double per) {
    return Eigen::Vector3d((x * per).array().round() / per);
  };
  plane.rms_m = std::round(surface_->rms_m / step) * step;
  const Eigen::Vector2d middle = cells_of(key).box().center();
  const Eigen::Vector3d at = rounded(surface_->to_map(middle), 1 / step);
  Eigen::Matrix3d axes;
  axes.col(2) = rounded(surface_->T_map_surface.linear().col(2), steps_per_radian).normalized();
  const Eigen::Vector3d u = rounded(surface_->T_map_surface.linear().col(0), steps_per_radian);
  axes.col(0) = (u - u.dot(axes.col(2)) * axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  plane.T_map_plane.linear() = axes;
  plane.T_map_plane.translation() = at - axes.leftCols<2>() * middle;
  return plane;
}

CellRaster GroundTiles::cells_of(const Key& key) const {
  if (!whole()) {
    // The first about the origin: near the middle of a small surface, which is all in it.
    const Eigen::Vector2i low = tile_edge * Eigen::Vector2i(key[0], key[1]).array() - tile_edge / 2;
    return {low, low.array() + tile_edge, d_};
  }
  const Eigen::AlignedBox2d box = outline_->box();
  return {(box.min() / d_).array().floor().cast<int>() - 2, (box.max() / d_).array().ceil().cast<int>() + 2,
          d_};
}

/// Cells of a raster and `more` about it, within `margin` of the outline's box.
CellRaster GroundTiles::cells_about(const CellRaster& cells, int more, int margin) const {
  const Eigen::AlignedBox2d box = outline_->box();
  const Eigen::Array2i first = (box.min() / d_).array().floor().cast<int>() - margin,
                       last = (box.max() / d_).array().ceil().cast<int>() + margin,
                       low = (cells.low().array() - more).max(first),
                       high = (cells.low().array() + Eigen::Array2i(cells.width(), cells.height()) + more)
                                  .min(last);
  return {low, high.max(low), d_};
}

GroundTiles::Key GroundTiles::key_at(const Eigen::Vector2d& uv) const {
  if (whole()) return {0, 0};
  const Eigen::Vector2i cell = (uv / d_).array().floor().cast<int>() + tile_edge / 2;
  return {cell.x() >> tile_bits, cell.y() >> tile_bits};
}

std::vector<GroundTiles::Key> GroundTiles::keys_in(const Eigen::AlignedBox2d& box) const {
  std::vector<Key> all;
  if (box.isEmpty()) return all;
  const Key low = key_at(box.min()), high = key_at(box.max());
  for (int y = low[1]; y <= high[1]; ++y)
    for (int x = low[0]; x <= high[0]; ++x) all.push_back({x, y});
  return all;
}

const GroundTiles::Tile& GroundTiles::tile(const Key& key, const OccupancyView& octree) const {
  geometry::end_if_interrupted();
  return tiles_.get(key, [&] { return Finder(*this, key, octree).find(); });
}

SurfacePtr GroundTiles::solid(const OccupancyView& octree) const {
  return solid_.get(0, [&]() -> SurfacePtr {
    if (outline_->box().isEmpty()) return surface_;
    const Eigen::Vector2d more = Eigen::Vector2d::Constant(2 * d_);  // of what is bridged beside it
    const Cuts cuts = cuts_in({outline_->box().min() - more, outline_->box().max() + more}, octree);
    if (cuts.bridged.empty() && cuts.voids.empty()) return surface_;
    return with_outline(*surface_, reshape(surface_->polygons, cuts));
  });
}

std::vector<Polygon> GroundTiles::solid_within(const Eigen::AlignedBox2d& box, const OccupancyView& octree,
                                               bool as_mapped) const {
  const Eigen::AlignedBox2d common = box.intersection(outline_->box());
  if (common.isEmpty()) return {};
  return reshape(clipped(surface_->polygons, box), as_mapped ? Cuts{} : cuts_in(common, octree));
}

const std::vector<Gap>& GroundTiles::gaps(const OccupancyView& octree) const {
  return gaps_.get(0, [&] { return find_gaps(octree); });
}

std::optional<Ground> GroundTiles::ground_at(const Eigen::Vector2d& uv, const OccupancyView& octree) const {
  if (!outline_->box().contains(uv)) return {};
  const Tile& one = tile(key_at(uv), octree);
  return ground_of(one.of.empty() ? beyond_bit : one.of[one.cells.cell_at(uv)]);
}

/// Of a tile's cell; empty beyond the outline.
std::optional<Ground> GroundTiles::ground_of(std::uint8_t of) {
  if ((of & beyond_bit) != 0) return {};
  return (of & bridged_bit) != 0 ? Ground::supported : static_cast<Ground>(of & ground_bits);
}

GroundTiles::Cuts GroundTiles::cuts_in(const Eigen::AlignedBox2d& box, const OccupancyView& octree) const {
  Cuts cuts;
  const auto add = [&](const std::vector<Ring2>& rectangles, std::vector<Ring2>& to) {
    for (const Ring2& ring : rectangles) {
      const Eigen::AlignedBox2d part = box.intersection(Eigen::AlignedBox2d(ring[0], ring[2]));
      if (part.isEmpty()) continue;
      const Eigen::Vector2d &low = part.min(), &high = part.max();
      to.push_back({low, {high.x(), low.y()}, high, {low.x(), high.y()}});
    }
  };
  // Bridged cells are covered with a cell more.
  const Eigen::Vector2d more = Eigen::Vector2d::Constant(d_);
  for (const Key& key : keys_in({box.min() - more, box.max() + more})) {
    const Tile& one = tile(key, octree);
    add(one.bridged, cuts.bridged);
    add(one.voids, cuts.voids);
  }
  return cuts;
}

std::vector<Polygon> GroundTiles::reshape(const std::vector<Polygon>& polygons, const Cuts& cuts) const {
  std::vector<Polygon> result = reshaped(polygons, cuts.bridged, cuts.voids);
  std::erase_if(result, [&](Polygon& polygon) {
    std::erase_if(polygon.holes, [&](const Ring2& hole) { return -geometry::signed_area(hole) < d_ * d_; });
    return geometry::signed_area(polygon.outer) < d_ * d_;
  });
  return result;
}

std::vector<Gap> GroundTiles::find_gaps(const OccupancyView& octree) const {
  std::vector<Gap> gaps;
  const std::vector<Key> keys = keys_in(outline_->box());
  if (keys.empty()) return gaps;
  const CellRaster first = cells_of(keys.front()), last = cells_of(keys.back());
  const CellRaster raster(first.low(), last.low() + Eigen::Vector2i(last.width(), last.height()), d_);
  Mask of(raster.cells(), beyond_bit), gap(raster.cells(), 0);
  for (const Key& key : keys) {
    const Tile& one = tile(key, octree);
    if (one.of.empty()) continue;
    const Eigen::Vector2i low = one.cells.low() - raster.low();
    for (int y = 0; y < one.cells.height(); ++y)
      std::copy_n(one.of.begin() + static_cast<std::ptrdiff_t>(y) * one.cells.width(), one.cells.width(),
                  of.begin() + static_cast<std::ptrdiff_t>(low.y() + y) * raster.width() + low.x());
  }
  for (std::size_t i = 0; i < of.size(); ++i) gap[i] = (of[i] & (beyond_bit | inside_bit)) == 0;
  const std::vector<float> half = raster.depth_in(gap);
  const auto kind = [&](std::size_t i) { return static_cast<Ground>(of[i] & ground_bits); };
  Mask taken(of.size(), 0);
  for (std::size_t i = 0; i < of.size(); ++i) {
    const unsigned same = of[i] & (ground_bits | bridged_bit);
    if (taken[i] != 0 || kind(i) == Ground::supported) continue;
    const bool across = (of[i] & bridged_bit) != 0;
    bool at_border = false;
    std::vector<std::size_t> part = raster.connected(
        i, taken, [&](std::size_t k) { return (of[k] & (ground_bits | bridged_bit)) == same; },
        [&](std::size_t k) { at_border |= (of[k] & beyond_bit) != 0; });
    float widest = 0;
    bool within = false;
    for (const std::size_t k : part) {
      within |= (of[k] & inside_bit) != 0;
      widest = std::max(widest, half[k]);
    }
    // Notches of the outer rim are edges, not gaps.
    if ((at_border && !across && !within) || part.size() < 4) continue;
    std::sort(part.begin(), part.end());
    std::vector<Polygon> outline = reshaped({}, raster.rows(part), {});
    const auto largest = std::max_element(
        outline.begin(), outline.end(),
        [](const Polygon& a, const Polygon& b) { return geometry::area_of(a) < geometry::area_of(b); });
    gaps.push_back({kind(i), across, std::max(1.0F, 2 * widest - 1) * d_, std::move(*largest)});
  }
  return gaps;
}

}  // namespace octosurf::planning
