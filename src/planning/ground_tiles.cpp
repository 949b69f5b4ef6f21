#include "planning/ground_tiles.hpp"

#include "geometry/rings.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace octosurf::planning {
namespace {

constexpr int tile_bits = 6, tile_edge = 1 << tile_bits;  // cells
/// Cells: where a tile depends on more about it, all is one tile.
constexpr int widest_halo = tile_edge / 2;
/// Steps to which a tile's plane is rounded: a sixteenth of a voxel, and as much at a tile's end.
constexpr double steps_per_voxel = 16, steps_per_radian = 512;

}  // namespace

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
  reach_ = box_over(surface_->T_map_surface, box_about(box, aside), -deepest_evidence * d - up, up);
}

GroundTiles::GroundTiles(const GroundTiles& before, SurfacePtr surface,
                         std::span<const Eigen::AlignedBox3d> changed)
    : GroundTiles(std::move(surface), before.d_, before.widest_bridged_m_) {
  if (before.whole() || whole()) {
    same_ = surface_ == before.surface_ &&
            std::ranges::none_of(changed, [&](const auto& cube) { return reach_.intersects(cube); });
  } else {
    const std::vector<Key> keys = keys_in(outline_->box());
    const Key low = keys.empty() ? Key{0, 0} : keys.front(), high = keys.empty() ? Key{-1, -1} : keys.back();
    Mask stale(keys.size(), 0);
    const auto index = [&](const Key& key) {
      return static_cast<std::size_t>(key[1] - low[1]) * static_cast<std::size_t>(high[0] - low[0] + 1) +
             static_cast<std::size_t>(key[0] - low[0]);
    };
    const auto add = [&](const Eigen::AlignedBox2d& box, double margin) {
      const Eigen::AlignedBox2d wide = box_about(box, margin * d_);
      const Key from = key_at(wide.min()), to = key_at(wide.max());
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
      return key[0] >= low[0] && key[0] <= high[0] && key[1] >= low[1] && key[1] <= high[1] &&
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
                       high = (cells.high().array() + more).min(last);
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

SurfacePtr GroundTiles::solid(const OccupancyView& octree) const {
  return solid_.get(0, [&]() -> SurfacePtr {
    if (outline_->box().isEmpty()) return surface_;
    const Cuts cuts = cuts_in(box_about(outline_->box(), 2 * d_), octree);  // of what is bridged beside it
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
      if (!part.isEmpty()) to.push_back(ring_of(part));
    }
  };
  // Bridged cells are covered with a cell more.
  for (const Key& key : keys_in(box_about(box, d_))) {
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
  const CellRaster raster(first.low(), last.high(), d_);
  Mask of(raster.cells(), beyond_bit), gap(raster.cells(), 0);
  for (const Key& key : keys) {
    const Tile& one = tile(key, octree);
    for (std::size_t i = 0; i < one.of.size(); ++i) of[raster.index_of(one.cells.place_of(i))] = one.of[i];
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
    const auto largest = std::ranges::max_element(outline, {}, geometry::area_of);
    gaps.push_back({kind(i), across, std::max(1.0F, 2 * widest - 1) * d_, std::move(*largest)});
  }
  return gaps;
}

}  // namespace octosurf::planning
