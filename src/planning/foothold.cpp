#include "geometry/even_odd.hpp"
#include "planning/contact_obstacles.hpp"
#include "planning/contact_shape.hpp"
#include "planning/convex_sides.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

// m: points on a side count as outside, however rounded; a thousandth of contact_region()'s grid.
constexpr double rounding = 1e-9;

/// A placed contact in the surface's frame, with the room that it needs.
struct Stand {
  Eigen::Vector2d middle;
  std::optional<double> radius;  ///< of a disc, whose distances do not use sides
  planning::ConvexSides sole, with_margin, with_frontier;
};

Stand stand_at(const planning::Sole& sole, std::optional<double> radius, const Eigen::Vector2d& middle,
               const ContactLimits& limits) {
  const auto placed = [&](double margin) {
    Ring2 ring = sole.with_margin(margin);
    for (Eigen::Vector2d& p : ring) p = middle + sole.to_surface(p);
    return planning::ConvexSides(ring);
  };
  return {middle, radius, placed(0), placed(limits.edge_margin_m),
          placed(std::max(limits.edge_margin_m, limits.frontier_margin_m))};
}

/// A contact's relation to the surface's edges.
struct Edges {
  bool middle_inside = false;
  double nearest = std::numeric_limits<double>::infinity();
  double deepest = 0;  ///< maximum depth of an edge under the contact
  bool margin = true, frontier = true;

  bool supported() const { return middle_inside && deepest <= rounding; }
};

double apart(const Eigen::AlignedBox2d& box, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.cwiseMin(b) - box.max()).cwiseMax(box.min() - a.cwiseMax(b)).maxCoeff();
}

double distance_to(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Stand& stand) {
  if (!stand.radius) return stand.sole.distance(a, b);
  return std::max(0.0,
                  (planning::closest_on_segment(a, b, stand.middle) - stand.middle).norm() - *stand.radius);
}

void look_at(const Ring2& ring, const std::vector<EdgeKind>* kinds, const Stand& stand, Edges& edges) {
  for (std::size_t i = 0, n = ring.size(); i < n; ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[i + 1 < n ? i + 1 : 0];
    edges.middle_inside ^= geometry::passes_left_of(stand.middle, a, b);
    const double gap = apart(stand.sole.box(), a, b);
    if (gap < 0) edges.deepest = std::max(edges.deepest, stand.sole.depth(a, b));
    if (gap < edges.nearest && edges.deepest <= rounding)
      edges.nearest = std::min(edges.nearest, distance_to(a, b, stand));
    if (edges.margin && apart(stand.with_margin.box(), a, b) < 0)
      edges.margin = stand.with_margin.depth(a, b) <= rounding;
    if (kinds != nullptr && (*kinds)[i] == EdgeKind::frontier && edges.frontier &&
        apart(stand.with_frontier.box(), a, b) < 0)
      edges.frontier = stand.with_frontier.depth(a, b) <= rounding;
  }
}

Edges look_around(const Surface& surface, const std::vector<PolygonEdges>* kinds, const Stand& stand) {
  Edges edges;
  for (std::size_t i = 0; i < surface.polygons.size(); ++i) {
    const Polygon& polygon = surface.polygons[i];
    look_at(polygon.outer, kinds != nullptr ? &(*kinds)[i].outer : nullptr, stand, edges);
    for (std::size_t h = 0; h < polygon.holes.size(); ++h)
      look_at(polygon.holes[h], kinds != nullptr ? &(*kinds)[i].holes[h] : nullptr, stand, edges);
  }
  return edges;
}

double share_on(const Surface& surface, const Stand& stand, const Edges& edges) {
  const double whole = stand.sole.area();
  if (edges.deepest <= rounding || whole <= 0) return edges.middle_inside ? 1 : 0;
  double sum = 0;
  for (const Polygon& polygon : surface.polygons) {
    sum += stand.sole.area_within(polygon.outer);
    for (const Ring2& hole : polygon.holes) sum += stand.sole.area_within(hole);
  }
  return std::clamp(sum / whole, 0.0, 1.0);
}

Eigen::AlignedBox2d box_of(const planning::Sole& sole, const Stand& stand, double margin) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : sole.with_margin(margin)) box.extend(stand.middle + sole.to_surface(p));
  return box;
}

/// Whether the contact with its margin meets one of these convex rings of the surface's frame.
bool reaches(const planning::Sole& sole, const Stand& stand, double margin, std::vector<Ring2> rings) {
  const Ring2 around = sole.with_margin(margin), off = planning::mirrored(around);
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector2d& p : around) bounds.extend(p);
  return std::any_of(rings.begin(), rings.end(), [&](Ring2& ring) {
    Eigen::AlignedBox2d box;
    for (Eigen::Vector2d& p : ring) {
      p = sole.to_turned(p - stand.middle);
      box.extend(p);
    }
    if (!bounds.intersects(box)) return false;
    return planning::ConvexSides(planning::minkowski_sum(off, ring)).depth(Eigen::Vector2d::Zero()) >
           rounding;
  });
}

bool beside_an_obstacle(const Surface& surface, const planning::Sole& sole, const Stand& stand, double margin,
                        const ContactLimits& limits, const OccupancyView& octree, const Snapshot* others) {
  const Eigen::AlignedBox2d box = box_of(sole, stand, margin);
  return reaches(sole, stand, margin,
                 planning::obstacles_over(surface, box.min(), box.max(), limits, octree, others));
}

/// The first limit that is not met.
std::optional<ContactRefusal> refusal_of(const Surface& surface, const planning::Sole& sole,
                                         const Stand& stand, const Edges& around, const ContactLimits& limits,
                                         const OccupancyView* octree, const Snapshot* others) {
  const std::vector<ContactRefusal> of_surface = planning::refusals_of(surface, limits);
  if (!of_surface.empty()) return of_surface.front();
  if (!around.supported()) return ContactRefusal::support;
  if (!around.margin) return ContactRefusal::margin;
  if (!around.frontier) return ContactRefusal::frontier;
  // With a margin first: obstacles over the contact itself are within it, too.
  const double margin = limits.obstacle_margin_m;
  if (limits.clearance_m > 0 && beside_an_obstacle(surface, sole, stand, margin, limits, *octree, others))
    return margin > 0 ? ContactRefusal::obstacle : ContactRefusal::clearance;
  if (limits.unknown_to_m > 0) {
    const Eigen::AlignedBox2d box = box_of(sole, stand, 0);
    if (reaches(sole, stand, 0, planning::unknown_over(surface, box.min(), box.max(), limits, *octree)))
      return ContactRefusal::unknown;
  }
  return {};
}

}  // namespace

Foothold foothold(const Surface& surface, const ContactShape& shape, const Eigen::Vector3d& at,
                  double yaw_rad, const ContactLimits& limits, const OccupancyView* octree,
                  const std::vector<PolygonEdges>* edges, const Snapshot* others) {
  planning::require_sensible(surface, shape, yaw_rad, limits, octree, edges);
  if (!at.allFinite()) throw Error(Error::Kind::usage, "foothold", "the point is not finite");
  const planning::Sole sole = planning::sole_of(shape, surface, yaw_rad, limits.up);
  const Eigen::Vector2d reference = (surface.T_map_surface.inverse() * at).head<2>();
  const std::optional<double> radius =
      shape.outline.empty() ? std::optional<double>(shape.radius) : std::nullopt;
  const Stand stand = stand_at(sole, radius, reference + sole.to_surface(sole.middle), limits);
  const Edges around = look_around(surface, limits.frontier_margin_m > 0 ? edges : nullptr, stand);

  Foothold result;
  result.surface = surface.id;
  result.T_map_contact = surface.T_map_surface * Eigen::Translation3d(reference.x(), reference.y(), 0);
  const Eigen::Vector2d heading = heading_on(surface, yaw_rad, limits.up);
  result.T_map_contact.rotate(
      Eigen::AngleAxisd(std::atan2(heading.y(), heading.x()), Eigen::Vector3d::UnitZ()));
  result.supported = share_on(surface, stand, around);
  result.margin_m =
      around.supported()
          ? around.nearest
          : -std::max(around.deepest, around.middle_inside ? 0.0 : stand.sole.depth(stand.middle));
  result.refused = refusal_of(surface, sole, stand, around, limits, octree, others);
  result.accepted = !result.refused;
  return result;
}

}  // namespace octosurf
