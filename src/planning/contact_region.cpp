#include "geometry/interruption.hpp"
#include "planning/contact_cells.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"

#include <string>

#include <octosurf/error.hpp>

namespace octosurf {
namespace planning {
namespace {

/// What a contact needs on all sides, in the surface's frame about its middle.
Ring2 room_of(const Sole& sole, double margin) {
  Ring2 ring = sole.with_margin(margin);
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
std::vector<ContactRefusal> refusals_of(const ContactCells& cells, const Sole& sole,
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

}  // namespace

ContactRegion region_on(const ContactCells& cells, const Surface& surface, const ContactShape& shape,
                        std::optional<double> yaw_rad, const ContactLimits& limits) {
  ContactRegion region{surface.id, surface.revision, yaw_rad, {}, 0, refusals_of(surface, limits)};
  if (!region.refused.empty()) return region;
  const Sole sole = sole_of(shape, surface, yaw_rad, limits.up);
  region.polygons = blocked(cells, sole, limits).free_polygons();
  if (region.polygons.empty()) region.refused = refusals_of(cells, sole, limits);
  region.area_m2 = area_of(region.polygons);
  const Eigen::Vector2d to_reference = -sole.to_surface(sole.middle);
  for_each_ring(region.polygons, [&](Ring2& ring) {
    for (Eigen::Vector2d& p : ring) p += to_reference;
  });
  return region;
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

}  // namespace octosurf
