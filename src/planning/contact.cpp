#include "geometry/interruption.hpp"
#include "planning/contact_cells.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"
#include "planning/unknown_space.hpp"
#include "planning/voxel_matter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace planning {
namespace {

/// The direction of a plane's intersection with that of (u, v), across which a steep one's voxels are narrow;
/// for a flatter one the map's x or y axis, along which voxels are aligned.
Eigen::Vector2d intersection_line(const Eigen::Matrix<double, 3, 2>& uv, const Eigen::Vector3d& normal) {
  constexpr double flat = 0.5;  // sine: of 30°, where a voxel is narrower by an eighth
  const Eigen::Vector2d steepest = uv.transpose() * normal;
  if (steepest.norm() > flat) return Eigen::Vector2d(steepest.y(), -steepest.x()).normalized();
  Eigen::Index axis = 0;
  uv.rowwise().norm().maxCoeff(&axis);
  return uv.row(axis).transpose().normalized();
}

/// What a cube of edge d covers of the plane, about the place of its middle.
Ring2 cover_of_cube(const Surface& surface, double d) {
  Ring2 corners;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d p;
    for (unsigned axis = 0; axis < 3; ++axis) p[axis] = (corner >> axis & 1u) != 0 ? d / 2 : -d / 2;
    corners.emplace_back((surface.T_map_surface.linear().transpose() * p).head<2>());
  }
  return convex_hull(std::move(corners));
}

/// A flat voxel covers a rectangle along the intersection of its plane with this one.
Ring2 cover_of(const VoxelMatter& matter, const Surface& surface) {
  const Eigen::Matrix<double, 3, 2> uv = surface.T_map_surface.linear().leftCols<2>();
  const Eigen::Vector2d along = intersection_line(uv, matter.normal), across(-along.y(), along.x()),
                        middle = uv.transpose() * (matter.middle - surface.T_map_surface.translation()),
                        half = matter.reach(uv * along) * along, side = matter.reach(uv * across) * across;
  return {middle - half - side, middle + half - side, middle + half + side, middle - half + side};
}

void mark_obstacles(const Surface& surface, const ContactLimits& limits, const OccupancyView& octree,
                    const Snapshot* others, BitRaster& cells) {
  const double d = octree.resolution();
  // The corners of a rectangle are √2 times as far off as its reach, plus rounding.
  const Eigen::AlignedBox3d box =
      box_about(box_over(surface.T_map_surface, cells.box(), limits.obstacle_from_m, limits.clearance_m),
                2 * MatterOfVoxels::farthest_reach * d + MatterOfVoxels::farthest_move);
  const Ring2 cube = cover_of_cube(surface, d);
  const Eigen::Isometry3d T_surface_map = surface.T_map_surface.inverse();
  MatterOfVoxels matter_of(others, d);
  octree.for_each_occupied(box, [&](const OccupancyView::Voxel& voxel) {
    if (voxel.surface == surface.id) return true;
    const VoxelMatter matter = matter_of(voxel);
    const double height = surface.plane.signed_distance(matter.middle);
    const double half = matter.reach(surface.plane.normal);
    if (height + half <= limits.obstacle_from_m || height - half >= limits.clearance_m) return true;
    cells.mark(matter.flat() ? cover_of(matter, surface)
                             : moved(cube, (T_surface_map * matter.middle).head<2>()));
    return true;
  });
}

void mark_unknown(const Surface& surface, const ContactLimits& limits, const OccupancyView& octree,
                  BitRaster& cells) {
  constexpr double patch = 32;  // voxels: boxes about patches of a slope hold little beside its slab
  const double d = octree.resolution();
  if (d <= 0) return;  // an empty view
  const double half = d / 2 * surface.plane.normal.lpNorm<1>();
  const Ring2 cube = cover_of_cube(surface, d);
  const Eigen::Isometry3d T_surface_map = surface.T_map_surface.inverse();
  // Voxels that follow one another along x are marked together.
  std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> run;
  const auto mark_run = [&] {
    if (!run) return;
    Ring2 ends = moved(cube, (T_surface_map * run->first).head<2>());
    for (const Eigen::Vector2d& p : cube) ends.push_back((T_surface_map * run->second).head<2>() + p);
    cells.mark(convex_hull(std::move(ends)));
    run.reset();
  };
  const Eigen::Vector2d low = cells.box().min(), high = cells.box().max();
  for (double u = low.x(); u <= high.x(); u += patch * d)
    for (double v = low.y(); v <= high.y(); v += patch * d) {
      const Eigen::Vector2d from(u, v), to = (from.array() + patch * d).min(high.array());
      const Eigen::AlignedBox3d box =
          box_over(surface.T_map_surface, {from, to}, limits.obstacle_from_m, limits.unknown_to_m);
      for_each_unknown(octree, box_about(box, MatterOfVoxels::farthest_reach * d),
                       [&](const Eigen::Vector3d& centre) {
                         const double height = surface.plane.signed_distance(centre);
                         if (!(height + half > limits.obstacle_from_m && height - half < limits.unknown_to_m))
                           return;
                         if (run && !(centre - run->second).isApprox(Eigen::Vector3d(d, 0, 0), 1e-6))
                           mark_run();
                         if (!run) run.emplace(centre, centre);
                         run->second = centre;
                       });
      mark_run();
    }
}

/// What a contact needs on all sides, in the surface's frame about its middle.
Ring2 room_of(const Sole& sole, double margin) {
  Ring2 ring = margin > 0 ? minkowski_sum(sole.outline, around_disc(margin)) : sole.outline;
  for (Eigen::Vector2d& p : ring) p = sole.to_surface(p);
  return ring;
}

/// Where the middle of a contact may not be.
BitRaster blocked(const ContactCells& cells, const Sole& sole, const ContactLimits& limits) {
  geometry::end_if_interrupted();
  BitRaster off_edges = cells.outside;
  const bool obstacles = limits.clearance_m > 0;
  if (obstacles && limits.obstacle_margin_m == limits.edge_margin_m) off_edges.add(cells.obstacles);
  BitRaster all = off_edges.dilated(room_of(sole, limits.edge_margin_m));
  if (obstacles && limits.obstacle_margin_m != limits.edge_margin_m)
    all.add(cells.obstacles.dilated(room_of(sole, limits.obstacle_margin_m)));
  if (limits.unknown_to_m > 0) all.add(cells.unknown.dilated(room_of(sole, 0)));
  return all;
}

/// The limits that alone leave nothing; if only their combination does, all of them.
std::vector<ContactRefusal> refusals_on(const ContactCells& cells, const Sole& sole,
                                        const ContactLimits& limits) {
  ContactLimits none;
  if (blocked(cells, sole, none).free_polygons().empty()) return {ContactRefusal::support};
  std::vector<ContactRefusal> alone, together;
  const auto ask = [&](ContactRefusal refusal, double ContactLimits::*field) {
    if (limits.*field <= 0) return;
    ContactLimits one = none;
    one.*field = limits.*field;
    if (refusal == ContactRefusal::obstacle) one.clearance_m = limits.clearance_m;
    if (blocked(cells, sole, one).free_polygons().empty()) alone.push_back(refusal);
    together.push_back(refusal);
  };
  ask(ContactRefusal::margin, &ContactLimits::edge_margin_m);
  ask(ContactRefusal::obstacle, &ContactLimits::obstacle_margin_m);
  ask(ContactRefusal::clearance, &ContactLimits::clearance_m);
  ask(ContactRefusal::unknown, &ContactLimits::unknown_to_m);
  return alone.empty() ? together : alone;
}

/// A placed contact, by what it touches.
class Stand {
 public:
  Stand(std::span<const ContactCells* const> cells, const Sole& sole, const Eigen::Vector2d& middle)
      : cells_(cells), sole_(sole), middle_(middle) {}

  bool touches(BitRaster ContactCells::*marks, double margin) const {
    const Ring2 room = this->room(margin);
    return std::ranges::any_of(cells_, [&](const auto* one) { return (one->*marks).touched_by(room); });
  }
  /// Share of its cells that lie on the surface, and how deep the deepest other one lies in it.
  std::array<double, 2> support() const {
    const Ring2 room = this->room(0);
    std::size_t all = 0, off = 0;
    double deepest = cells_.empty() ? depth_in(room, middle_) : 0;
    for (const ContactCells* one : cells_)
      one->outside.for_each_touched(room, [&](const Eigen::Vector2d& cell, bool marked) {
        ++all;
        off += marked;
        if (marked) deepest = std::max(deepest, depth_in(room, cell) + one->outside.edge() / 2);
      });
    return {all == 0 ? 0 : 1 - static_cast<double>(off) / static_cast<double>(all), deepest};
  }
  /// m, to the nearest edge, to a millimetre.
  double margin() const {
    double kept = 0, met = Foothold::farthest_margin_m;
    if (!touches(&ContactCells::outside, met)) return met;
    while (met - kept > 1e-3) {
      const double middle = (kept + met) / 2;
      (touches(&ContactCells::outside, middle) ? met : kept) = middle;
    }
    return kept;
  }

 private:
  /// What it needs with a margin, surface's frame.
  Ring2 room(double margin) const { return moved(room_of(sole_, margin), middle_); }

  std::span<const ContactCells* const> cells_;
  const Sole& sole_;
  Eigen::Vector2d middle_;
};

/// The first limit that is not met.
std::optional<ContactRefusal> refusal_of(const Surface& surface, const Stand& stand, bool supported,
                                         const ContactLimits& limits) {
  const std::vector<ContactRefusal> of_surface = refusals_of(surface, limits);
  if (!of_surface.empty()) return of_surface.front();
  if (!supported) return ContactRefusal::support;
  if (stand.touches(&ContactCells::outside, limits.edge_margin_m)) return ContactRefusal::margin;
  // With a margin first: obstacles over the contact itself are within it, too.
  const double margin = limits.obstacle_margin_m;
  if (limits.clearance_m > 0 && stand.touches(&ContactCells::obstacles, margin))
    return margin > 0 ? ContactRefusal::obstacle : ContactRefusal::clearance;
  if (limits.unknown_to_m > 0 && stand.touches(&ContactCells::unknown, 0)) return ContactRefusal::unknown;
  return {};
}

}  // namespace

ContactCells::ContactCells(const Surface& surface, const Eigen::AlignedBox2d& box,
                           const Eigen::AlignedBox2d& near, double edge, const ContactLimits& limits,
                           const OccupancyView* octree, const Snapshot* others)
    : outside(box, edge), obstacles(near, edge), unknown(obstacles) {
  if (limits.clearance_m > 0) mark_obstacles(surface, limits, *octree, others, obstacles);
  if (limits.unknown_to_m > 0) mark_unknown(surface, limits, *octree, unknown);
  outside.mark_outside(surface.polygons);
}

ContactRegion region_on(const ContactCells& cells, const Surface& surface, const ContactShape& shape,
                        std::optional<double> yaw_rad, const ContactLimits& limits) {
  ContactRegion region{surface.id, surface.revision, yaw_rad, {}, 0, refusals_of(surface, limits)};
  if (!region.refused.empty()) return region;
  const Sole sole = sole_of(shape, surface, yaw_rad, limits.up);
  region.polygons = blocked(cells, sole, limits).free_polygons();
  if (region.polygons.empty()) region.refused = refusals_on(cells, sole, limits);
  region.area_m2 = area_of(region.polygons);
  const Eigen::Vector2d to_reference = -sole.to_surface(sole.middle);
  for_each_ring(region.polygons, [&](Ring2& ring) { ring = moved(std::move(ring), to_reference); });
  return region;
}

Foothold foothold_on(std::span<const ContactCells* const> cells, const Surface& surface,
                     const ContactShape& shape, const Eigen::Vector3d& at, double yaw_rad,
                     const ContactLimits& limits) {
  const Sole sole = sole_of(shape, surface, yaw_rad, limits.up);
  const Eigen::Vector2d reference = (surface.T_map_surface.inverse() * at).head<2>();
  const Stand stand(cells, sole, reference + sole.to_surface(sole.middle));
  const bool supported = !cells.empty() && !stand.touches(&ContactCells::outside, 0);
  Foothold result;
  result.surface = surface.id;
  result.T_map_contact = surface.T_map_surface * Eigen::Translation3d(reference.x(), reference.y(), 0);
  const Eigen::Vector2d heading = heading_on(surface, yaw_rad, limits.up);
  result.T_map_contact.rotate(
      Eigen::AngleAxisd(std::atan2(heading.y(), heading.x()), Eigen::Vector3d::UnitZ()));
  if (supported) {
    result.supported = 1;
    result.margin_m = stand.margin();
  } else {
    const auto [share, deepest] = stand.support();
    result.supported = share;
    result.margin_m = -deepest;
  }
  result.refused = refusal_of(surface, stand, supported, limits);
  result.accepted = !result.refused;
  return result;
}

}  // namespace planning

ContactRegion contact_region(const Surface& surface, const ContactShape& shape, std::optional<double> yaw_rad,
                             const ContactLimits& limits, const OccupancyView* octree,
                             const Snapshot* others) {
  constexpr double farthest = 1000;  // m, of a corner from the surface's origin
  planning::require_sensible(shape, yaw_rad, limits, octree);
  Eigen::AlignedBox2d box = planning::box_of(surface);
  for (const Polygon& polygon : surface.polygons)
    for (const Eigen::Vector2d& p : polygon.outer)
      if (!(p.cwiseAbs().maxCoeff() < farthest))
        throw Error(Error::Kind::usage, "surface " + std::to_string(surface.id),
                    "has a corner that is not finite or a kilometre from its origin");
  // The contact is on the surface, so only obstacles within the margin matter.
  if (!box.isEmpty()) box = planning::box_about(box, 1.01 * limits.obstacle_margin_m);
  const planning::ContactCells cells(surface, box, box, planning::BitRaster::edge_for(surface), limits,
                                     octree, others);
  return planning::region_on(cells, surface, shape, yaw_rad, limits);
}

Foothold foothold(const Surface& surface, const ContactShape& shape, const Eigen::Vector3d& at,
                  double yaw_rad, const ContactLimits& limits, const OccupancyView* octree,
                  const Snapshot* others) {
  planning::require_sensible(shape, yaw_rad, limits, octree);
  if (!at.allFinite()) throw Error(Error::Kind::usage, "foothold", "the point is not finite");
  const Eigen::Vector2d uv = (surface.T_map_surface.inverse() * at).head<2>();
  const auto within = [&](double margin) { return planning::box_about(uv, 1.01 * (shape.reach() + margin)); };
  const Eigen::AlignedBox2d box = within(std::max(Foothold::farthest_margin_m, limits.edge_margin_m));
  if (!box.intersects(planning::box_of(surface)))
    return planning::foothold_on({}, surface, shape, at, yaw_rad, limits);
  const planning::ContactCells cells(surface, box, within(limits.obstacle_margin_m),
                                     planning::BitRaster::edge_for(surface), limits, octree, others);
  return planning::foothold_on(std::array{&cells}, surface, shape, at, yaw_rad, limits);
}

}  // namespace octosurf
