#include "surfaces/surface_outline.hpp"

#include "geometry/voxel_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace octosurf::surfaces {
namespace {

/// Distance from a point inside a cube, along a unit direction, to the cube's side. `at`: from the cube's
/// centre.
double to_side(const Eigen::Vector3d& at, const Eigen::Vector3d& direction, double half_edge) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double speed = std::fabs(direction[axis]);
    if (speed < 1e-9) continue;
    const double left = half_edge - std::copysign(1.0, direction[axis]) * at[axis];
    nearest = std::min(nearest, std::max(0.0, left) / speed);
  }
  return nearest;
}

}  // namespace

SurfaceOutline::SurfaceOutline(const Eigen::Isometry3d& frame, double resolution)
    : PlaneHash(frame, resolution) {
  edge_bleed_.fill(resolution);
}

void SurfaceOutline::rehash(const Eigen::Isometry3d& frame) {
  PlaneHash::rehash(frame);
  outline_.reset();
  intersections_.clear();
}

Eigen::Vector2d SurfaceOutline::outline_point(const Eigen::Vector3f& p) const {
  const Eigen::Isometry3d& frame = hash_frame();
  const Eigen::Vector2d cells =
      frame.linear().leftCols<2>().transpose() * (p.cast<double>() - frame.translation()) / resolution();
  return (cells / geometry::Outline::quantum).array().round() * geometry::Outline::quantum;
}

/// Direction away from the occupied cells among the 5 × 5 around one, if significant: the sum of their
/// offsets is 15 cells at a straight boundary, 9 at the end of a bar three wide, and at most 3 at a pinhole.
std::optional<Eigen::Vector3d> SurfaceOutline::outward(geometry::PlaneCell cell) const {
  constexpr std::uint32_t row = 0b11111, column = 0x108421;
  constexpr int clear = 5;
  const std::uint32_t around = raster_.around(cell);
  if ((around & ring) == ring) return {};
  Eigen::Vector2i inward(0, 0);
  for (const int k : {-2, -1, 1, 2})
    inward += k * Eigen::Vector2i(geometry::bit_count(around & column << (k + 2)),
                                  geometry::bit_count(around & row << 5 * (k + 2)));
  if (inward.squaredNorm() < clear * clear) return {};
  return -(hash_frame().linear().leftCols<2>() * inward.cast<double>().normalized());
}

std::optional<Eigen::Vector3f> SurfaceOutline::boundary_point(const Inlier& inlier, double edge_bleed) const {
  constexpr double worth_a_site = 0.1;  // d
  const auto direction = outward(cell_of(inlier.position));
  if (!direction) return {};
  const Eigen::Vector3d at =
      (inlier.position - geometry::VoxelGrid(resolution()).centre_of(inlier.key)).cast<double>();
  if (at.norm() < resolution() / 256) return {};  // adopted from an octree: no reading
  const double half = resolution() / 2;
  const double beyond = std::min(to_side(at, *direction, half), to_side(at, -*direction, half)) - edge_bleed;
  if (beyond < worth_a_site * resolution()) return {};
  return (inlier.position.cast<double>() + beyond * *direction).cast<float>();
}

/// Deep inside, a lattice of every `spacing`-th cell's centre replaces the inliers, every other row shifted
/// by half of that, so that no four are cocircular.
///
/// Only triangles with a side over α > 3.99 cells are dropped. Their empty circles have radius ρ > α/2, those
/// of the reduced sites are empty of inliers and vice versa, and so the rings are those of all inliers: (1) A
/// circle centred outside the deep cells contains none of them. On the way from the centre to a deep cell,
/// the point √2 before the first one would lie in an occupied cell of the boundary that the circle contains.
/// (2) A circle centred in a deep cell contains a site: the lattice's largest empty circle has radius
/// ⅝·spacing, and where a lattice cell is not deep, an occupied cell of the boundary lies on the way to it,
/// within √2 of the point where that way leaves the deep cells. So ⅝·spacing + √2 ≤ α/2 suffices; for a
/// spacing of 2, by enumeration of the positions in a cell, α > 3.99. Boundary points and intersections are
/// sites beside the inliers of cells that are not deep, with and without the lattice.
void SurfaceOutline::add_sites_of(geometry::PlaneCell cell, int spacing,
                                  std::vector<Eigen::Vector2d>& sites) const {
  if (raster_.deep_inside(cell)) {
    const int shift = (cell.v & spacing) != 0 ? spacing / 2 : 0;
    if (cell.v % spacing == 0 && (cell.u + shift) % spacing == 0)
      sites.emplace_back(cell.u + 0.5, cell.v + 0.5);
    return;
  }
  inliers().for_each_in(cell, [&](const Inlier& inlier) {
    sites.push_back(outline_point(inlier.position));
    const double edge_bleed = edge_bleed_[inlier.range_class];
    if (edge_bleed >= resolution()) return;
    if (const auto p = boundary_point(inlier, edge_bleed)) sites.push_back(outline_point(*p));
  });
  if (const auto met = intersections_.find(cell.packed()); met != intersections_.end())
    sites.insert(sites.end(), met->second.begin(), met->second.end());
}

std::vector<Eigen::Vector2d> SurfaceOutline::intersection_sites() const {
  std::vector<Eigen::Vector2d> all;
  for (const auto& [cell, sites] : intersections_) all.insert(all.end(), sites.begin(), sites.end());
  return all;
}

void SurfaceOutline::update_raster(double max_hole_size, const sensing::NoiseModel* noise) {
  const double alpha = outline_alpha(max_hole_size);
  EdgeBleed edge_bleed;
  edge_bleed.fill(resolution());
  for (unsigned c = 0; noise != nullptr && c < sensing::NoiseModel::classes; ++c)
    edge_bleed[c] = std::min(resolution(), noise->edge_bleed(c));
  const bool anew = !outline_ || outline_->outline.alpha() != alpha;
  if (anew) outline_ = std::make_shared<SharedOutline>(alpha);
  if (anew || edge_bleed != edge_bleed_) raster_.change_all();
  edge_bleed_ = edge_bleed;
  for (const geometry::CellBits::Cells& cells : raster_.take_changes(alpha > 3.99))
    changed_[cells.tile.packed()] |= cells.bits;
}

OutlineChange SurfaceOutline::take_change(SurfaceId id, const Eigen::Affine2d& T_surface_outline,
                                          IntersectionSites intersections) {
  const double alpha = outline_->outline.alpha();
  int spacing = 2;
  while (spacing < 16 && 0.625 * (2 * spacing) + std::numbers::sqrt2 <= alpha / 2) spacing *= 2;
  std::map<std::uint64_t, std::uint64_t> changed = std::exchange(changed_, {});
  const auto add_cells = [&](const IntersectionSites& with, const IntersectionSites& without) {
    for (const auto& [key, sites] : with)
      if (const auto same = without.find(key); same == without.end() || same->second != sites) {
        const auto cell = geometry::PlaneCell::unpack(key);
        changed[geometry::CellBits::tile_of(cell).packed()] |= std::uint64_t{1}
                                                               << geometry::CellBits::bit_of(cell);
      }
  };
  add_cells(intersections, intersections_);
  add_cells(intersections_, intersections);
  intersections_ = std::move(intersections);
  OutlineChange change{id, outline_, T_surface_outline, {}, {}};
  for (const auto& [tile, bits] : changed)
    geometry::CellBits::Cells{geometry::PlaneCell::unpack(tile), bits}.for_each(
        [&](geometry::PlaneCell cell) {
          const std::size_t before = change.sites.size();
          add_sites_of(cell, spacing, change.sites);
          change.cells.push_back({cell, static_cast<std::uint32_t>(change.sites.size() - before)});
        });
  polygons_.clear();
  polygons_stale_ = false;
  return change;
}

}  // namespace octosurf::surfaces
