// The parts of SurfaceModel that make its polygons.
#include "geometry/morton.hpp"
#include "surfaces/intersections.hpp"
#include "surfaces/surface_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

namespace octosurf::surfaces {
namespace {

/// Effort: of a cell, to which intersections are rounded, so that a site changes only when the planes have
/// moved by that much. The rounding moves a site by at most a sixteenth of a voxel along each axis.
constexpr double intersection_quantum = 1.0 / 8;
Eigen::Vector2d rounded(const Eigen::Vector2d& outline_point) {
  return (outline_point / intersection_quantum).array().round() * intersection_quantum;
}

/// In order of the tiles, each once.
std::vector<geometry::CellBits::Cells> united(std::vector<geometry::CellBits::Cells> cells) {
  std::sort(cells.begin(), cells.end(),
            [](const auto& a, const auto& b) { return a.tile.packed() < b.tile.packed(); });
  std::size_t count = 0;
  for (const geometry::CellBits::Cells& more : cells) {
    if (count > 0 && cells[count - 1].tile.packed() == more.tile.packed())
      cells[count - 1].bits |= more.bits;
    else
      cells[count++] = more;
  }
  cells.resize(count);
  return cells;
}

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

Eigen::Vector2d SurfaceModel::outline_point(const Eigen::Vector3f& p) const {
  const Eigen::Vector2d cells =
      hash_frame_.linear().leftCols<2>().transpose() * (p.cast<double>() - hash_origin_) / resolution_;
  return (cells / geometry::Outline::quantum).array().round() * geometry::Outline::quantum;
}

double SurfaceModel::outline_alpha(double max_hole_size) const {
  return max_hole_size * cos_largest_tilt / resolution_;
}

Eigen::Affine2d SurfaceModel::T_surface_outline() const {
  const Eigen::Vector3d along = hash_frame_.linear().col(2);
  const auto on_plane = [&](double u, double v) -> Eigen::Vector2d {
    const Eigen::Vector3d p = hash_frame_ * Eigen::Vector3d(u * resolution_, v * resolution_, 0);
    const Eigen::Vector3d q = p - plane_.signed_distance(p) / plane_.normal.dot(along) * along;
    return (pose_.linear().transpose() * (q - pose_.translation())).head<2>();
  };
  Eigen::Affine2d T = Eigen::Affine2d::Identity();
  T.translation() = on_plane(0, 0);
  T.linear().col(0) = on_plane(1, 0) - T.translation();
  T.linear().col(1) = on_plane(0, 1) - T.translation();
  return T;
}

/// Direction away from the occupied cells among the 5 × 5 around one, if significant: the sum of their
/// offsets is 15 cells at a straight boundary, 9 at the end of a bar three wide, and at most 3 at a pinhole.
std::optional<Eigen::Vector3d> SurfaceModel::outward(geometry::PlaneCell cell) const {
  constexpr std::uint32_t next_to_it = 0b00000'01110'01010'01110'00000, row = 0b11111, column = 0x108421;
  constexpr int clear = 5;
  const std::uint32_t around = bits_.around(cell);
  if ((around & next_to_it) == next_to_it) return {};
  Eigen::Vector2i inward(0, 0);
  for (const int k : {-2, -1, 1, 2})
    inward += k * Eigen::Vector2i(geometry::bit_count(around & column << (k + 2)),
                                  geometry::bit_count(around & row << 5 * (k + 2)));
  if (inward.squaredNorm() < clear * clear) return {};
  return -(hash_frame_.linear().leftCols<2>() * inward.cast<double>().normalized());
}

std::optional<Eigen::Vector3f> SurfaceModel::boundary_point(const Inlier& inlier, double edge_bleed) const {
  constexpr double worth_a_site = 0.1;  // d
  const auto direction = outward(cell_of(inlier.position));
  if (!direction) return {};
  const Eigen::Vector3d at =
      (inlier.position - geometry::VoxelGrid(resolution_).centre_of(inlier.key)).cast<double>();
  if (at.norm() < resolution_ / 256) return {};  // adopted from an octree: no reading
  const double half = resolution_ / 2;
  const double beyond = std::min(to_side(at, *direction, half), to_side(at, -*direction, half)) - edge_bleed;
  if (beyond < worth_a_site * resolution_) return {};
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
void SurfaceModel::add_sites_of(geometry::PlaneCell cell, int spacing,
                                std::vector<Eigen::Vector2d>& sites) const {
  if (bits_.deep_inside(cell)) {
    const int shift = (cell.v & spacing) != 0 ? spacing / 2 : 0;
    if (cell.v % spacing == 0 && (cell.u + shift) % spacing == 0)
      sites.emplace_back(cell.u + 0.5, cell.v + 0.5);
    return;
  }
  inliers_.for_each_in(cell, [&](const Inlier& inlier) {
    sites.push_back(outline_point(inlier.position));
    const double edge_bleed = edge_bleed_[inlier.range_class];
    if (edge_bleed >= resolution_) return;
    if (const auto p = boundary_point(inlier, edge_bleed)) sites.push_back(outline_point(*p));
  });
  const auto met = intersections_.find(geometry::CellBits::tile_of(cell).packed());
  if (met == intersections_.end()) return;
  for (const IntersectionSite& site : met->second)
    if (site.bit == geometry::CellBits::bit_of(cell)) sites.push_back(site.at);
}

SurfaceModel::IntersectionSites SurfaceModel::find_intersections(const SurfaceStore& others,
                                                                 double gap) const {
  IntersectionSites found;
  Intersections intersections(*this, others, gap);
  std::vector<Eigen::Vector3d> points;
  std::vector<IntersectionSite> sites;
  for (const geometry::CellBits::Cells& boundary : bits_.boundary()) {
    if (!intersections.look_about(boundary.tile)) continue;
    sites.clear();
    boundary.for_each([&](geometry::PlaneCell cell) {
      const auto bit = static_cast<std::uint8_t>(geometry::CellBits::bit_of(cell));
      inliers_.for_each_in(cell, [&](const Inlier& inlier) {
        intersections.points_from(inlier, points);
        for (const Eigen::Vector3d& p : points)
          sites.push_back({bit, rounded(outline_point(p.cast<float>()))});
      });
    });
    if (!sites.empty()) found.emplace(boundary.tile.packed(), sites);
  }
  return found;
}

std::vector<Eigen::Vector2d> SurfaceModel::intersection_sites() const {
  std::vector<Eigen::Vector2d> all;
  for (const auto& [tile, sites] : intersections_)
    for (const IntersectionSite& site : sites) all.push_back(site.at);
  return all;
}

/// For each tile where `a` and `b` differ, the cells with sites in `a` that `b` lacks.
void SurfaceModel::add_cells_of(const IntersectionSites& a, const IntersectionSites& b,
                                std::vector<geometry::CellBits::Cells>& cells) {
  for (const auto& [tile, sites] : a) {
    if (const auto same = b.find(tile); same != b.end() && same->second == sites) continue;
    geometry::CellBits::Cells with{geometry::PlaneCell::unpack(tile), 0};
    for (const IntersectionSite& site : sites) with.bits |= std::uint64_t{1} << site.bit;
    cells.push_back(with);
  }
}

void SurfaceModel::update_raster(double max_hole_size, const sensing::NoiseModel* noise) {
  const double alpha = outline_alpha(max_hole_size);
  EdgeBleed edge_bleed;
  edge_bleed.fill(resolution_);
  for (unsigned c = 0; noise != nullptr && c < sensing::NoiseModel::classes; ++c)
    edge_bleed[c] = std::min(resolution_, noise->edge_bleed(c));
  const bool anew = !outline_ || outline_->outline.alpha() != alpha;
  if (anew) outline_ = std::make_shared<SharedOutline>(alpha, file_);
  if (anew || edge_bleed != edge_bleed_) bits_.change_all();
  edge_bleed_ = edge_bleed;
  const std::vector<geometry::CellBits::Cells> changes = bits_.take_changes(alpha > 3.99);
  changed_.insert(changed_.end(), changes.begin(), changes.end());
}

OutlineChange SurfaceModel::take_outline_change(double max_hole_size, const SurfaceStore* others) {
  const double alpha = outline_->outline.alpha();
  int spacing = 2;
  while (spacing < 16 && 0.625 * (2 * spacing) + std::numbers::sqrt2 <= alpha / 2) spacing *= 2;
  std::vector<geometry::CellBits::Cells> changed = std::exchange(changed_, {});
  IntersectionSites intersections;
  if (others != nullptr) intersections = find_intersections(*others, max_hole_size);
  add_cells_of(intersections, intersections_, changed);
  add_cells_of(intersections_, intersections, changed);
  intersections_ = std::move(intersections);
  OutlineChange change{id_, outline_, T_surface_outline(), {}, {}};
  for (const geometry::CellBits::Cells& cells : united(std::move(changed)))
    cells.for_each([&](geometry::PlaneCell cell) {
      const std::size_t before = change.sites.size();
      add_sites_of(cell, spacing, change.sites);
      change.cells.push_back({cell, static_cast<std::uint32_t>(change.sites.size() - before)});
    });
  polygons_.clear();
  polygons_stale_ = false;
  return change;
}

std::vector<Polygon> polygons_with(const OutlineChange& change) {
  SharedOutline& shared = *change.outline;
  if (shared.broken) shared.outline.recover();
  shared.broken = true;
  std::span<const Eigen::Vector2d> sites = change.sites;
  for (const OutlineChange::Cell& cell : change.cells) {
    shared.outline.set(cell.cell, sites.first(cell.sites));
    sites = sites.subspan(cell.sites);
  }
  if (!change.cells.empty()) shared.polygons = shared.outline.update();
  shared.broken = false;
  std::vector<Polygon> polygons = shared.polygons;
  for (Polygon& polygon : polygons) {
    for (Eigen::Vector2d& p : polygon.outer) p = change.T_surface_outline * p;
    for (Ring2& hole : polygon.holes)
      for (Eigen::Vector2d& p : hole) p = change.T_surface_outline * p;
  }
  return polygons;
}

void SurfaceModel::derive(double max_hole_size, const sensing::NoiseModel* noise,
                          const SurfaceStore* others) {
  update_raster(max_hole_size, noise);
  polygons_ = polygons_with(take_outline_change(max_hole_size, others));
}

}  // namespace octosurf::surfaces
