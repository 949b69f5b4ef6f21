#include "geometry/interruption.hpp"
#include "planning/blocked_polygon.hpp"
#include "planning/contact_obstacles.hpp"
#include "planning/contact_shape.hpp"
#include "planning/convex_sides.hpp"
#include "planning/rings.hpp"

#include <string>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

template <typename To>
Polygon moved(Polygon polygon, const To& to) {
  for (Eigen::Vector2d& p : polygon.outer) p = to(p);
  for (Ring2& hole : polygon.holes)
    for (Eigen::Vector2d& p : hole) p = to(p);
  return polygon;
}

/// A surface in the plane rotated with the contact, and the obstacles on it.
struct TurnedGround {
  planning::Sole sole;
  std::vector<Polygon> polygons;
  const std::vector<PolygonEdges>* edges = nullptr;
  std::vector<Polygon> obstacles, unknown;  ///< may overlap
};

// m: half of the range of blocked_polygon.hpp's grid, to include a contact's reach.
constexpr double farthest_corner = 1000;

void require_near(const Surface& surface) {
  for (const Polygon& polygon : surface.polygons)
    planning::for_each_edge(polygon, [&surface](const Eigen::Vector2d& p, const Eigen::Vector2d&) {
      if (!(p.cwiseAbs().maxCoeff() < farthest_corner))
        throw Error(Error::Kind::usage, "surface " + std::to_string(surface.id),
                    "has a corner that is not finite or a kilometre from its origin");
    });
}

TurnedGround ground_of(const Surface& surface, planning::Sole sole, const ContactLimits& limits,
                       const OccupancyView* octree, const std::vector<PolygonEdges>* edges,
                       const Snapshot* others) {
  TurnedGround ground{std::move(sole), {}, edges, {}, {}};
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : surface.polygons) {
    for (const Eigen::Vector2d& p : polygon.outer) box.extend(p);
    ground.polygons.push_back(
        moved(polygon, [&](const Eigen::Vector2d& uv) { return ground.sole.to_turned(uv); }));
  }
  if (box.isEmpty()) return ground;
  // The contact is on the surface, so only obstacles within the margin matter.
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(limits.obstacle_margin_m * 1.005);
  const Eigen::Vector2d low = box.min() - margin, high = box.max() + margin;
  // Of their union, as one of furniture has far fewer edges than its voxels.
  const auto joined = [&](std::vector<Ring2> rings) {
    for (Ring2& ring : rings)
      for (Eigen::Vector2d& p : ring) p = ground.sole.to_turned(p);
    return planning::reshaped({}, rings, {});
  };
  if (limits.clearance_m > 0)
    ground.obstacles = joined(planning::obstacles_over(surface, low, high, limits, *octree, others));
  if (limits.unknown_to_m > 0)
    ground.unknown = joined(planning::unknown_over(surface, low, high, limits, *octree));
  return ground;
}

/// The positions of the contact's middle that are blocked by an obstacle.
Ring2 kept_off(const planning::Sole& sole, double margin) {
  const double s = planning::grid_slack;
  return planning::minkowski_sum(planning::mirrored(sole.with_margin(margin)),
                                 {{-s, -s}, {s, -s}, {s, s}, {-s, s}});
}

void block_frontier(const Ring2& ring, const std::vector<EdgeKind>& kinds, const Ring2& kernel,
                    std::vector<Ring2>& blocked) {
  for (std::size_t i = 0; i < ring.size(); ++i)
    if (kinds[i] == EdgeKind::frontier)
      blocked.push_back(planning::minkowski_sum(kernel, {ring[i], ring[(i + 1) % ring.size()]}));
}

/// Areas about frontiers that are blocked for the contact's middle.
std::vector<Ring2> blocked_by_frontiers(const TurnedGround& ground, std::size_t index,
                                        const ContactLimits& limits) {
  std::vector<Ring2> blocked;
  if (limits.frontier_margin_m <= limits.edge_margin_m) return blocked;
  const Polygon& polygon = ground.polygons[index];
  const Ring2 off_frontier = kept_off(ground.sole, limits.frontier_margin_m);
  const PolygonEdges& kinds = (*ground.edges)[index];
  block_frontier(polygon.outer, kinds.outer, off_frontier, blocked);
  for (std::size_t h = 0; h < polygon.holes.size(); ++h)
    block_frontier(polygon.holes[h], kinds.holes[h], off_frontier, blocked);
  return blocked;
}

/// The positions of the contact's middle on one polygon that meet all geometric limits.
std::vector<Polygon> free_part(const TurnedGround& ground, std::size_t index, const ContactLimits& limits) {
  geometry::end_if_interrupted();
  using Polygons = std::span<const Polygon>;
  return planning::inset(
      ground.polygons[index], kept_off(ground.sole, limits.edge_margin_m),
      blocked_by_frontiers(ground, index, limits),
      {{kept_off(ground.sole, limits.obstacle_margin_m),
        limits.clearance_m > 0 ? Polygons(ground.obstacles) : Polygons()},
       {kept_off(ground.sole, 0), limits.unknown_to_m > 0 ? Polygons(ground.unknown) : Polygons()}});
}

std::vector<Polygon> free_part(const TurnedGround& ground, const ContactLimits& limits) {
  std::vector<Polygon> all;
  for (std::size_t i = 0; i < ground.polygons.size(); ++i)
    for (Polygon& part : free_part(ground, i, limits)) all.push_back(std::move(part));
  return all;
}

/// The limits that alone leave nothing of `ground`; if only their combination does, all of them.
std::vector<ContactRefusal> refusals_of(const TurnedGround& ground, const ContactLimits& limits) {
  ContactLimits none;
  none.obstacle_from_m = limits.obstacle_from_m;
  if (free_part(ground, none).empty()) return {ContactRefusal::support};
  std::vector<std::pair<ContactRefusal, ContactLimits>> each;
  const auto ask = [&](ContactRefusal refusal, double ContactLimits::*field) {
    if (limits.*field <= 0) return;
    ContactLimits one = none;
    one.*field = limits.*field;
    if (refusal == ContactRefusal::obstacle) one.clearance_m = limits.clearance_m;
    each.emplace_back(refusal, one);
  };
  ask(ContactRefusal::margin, &ContactLimits::edge_margin_m);
  ask(ContactRefusal::frontier, &ContactLimits::frontier_margin_m);
  ask(ContactRefusal::obstacle, &ContactLimits::obstacle_margin_m);
  ask(ContactRefusal::clearance, &ContactLimits::clearance_m);
  ask(ContactRefusal::unknown, &ContactLimits::unknown_to_m);
  std::vector<ContactRefusal> alone, together;
  for (const auto& [refusal, one] : each) {
    if (free_part(ground, one).empty()) alone.push_back(refusal);
    together.push_back(refusal);
  }
  return alone.empty() ? together : alone;
}

}  // namespace

ContactRegion contact_region(const Surface& surface, const ContactShape& shape, std::optional<double> yaw_rad,
                             const ContactLimits& limits, const OccupancyView* octree,
                             const std::vector<PolygonEdges>* edges, const Snapshot* others) {
  planning::require_sensible(surface, shape, yaw_rad, limits, octree, edges);
  require_near(surface);
  ContactRegion region;
  region.surface = surface.id;
  region.revision = surface.revision;
  region.yaw_rad = yaw_rad;
  region.refused = planning::refusals_of(surface, limits);
  if (!region.refused.empty()) return region;
  const TurnedGround ground = ground_of(surface, planning::sole_of(shape, surface, yaw_rad, limits.up),
                                        limits, octree, edges, others);
  std::vector<Polygon> parts = free_part(ground, limits);
  region.area_m2 = planning::area_of(parts);
  for (Polygon& part : parts)
    region.polygons.push_back(moved(std::move(part), [&ground](const Eigen::Vector2d& middle) {
      return ground.sole.to_surface(middle - ground.sole.middle);
    }));
  if (region.polygons.empty()) region.refused = refusals_of(ground, limits);
  return region;
}

}  // namespace octosurf
