#include "geometry/rings.hpp"
#include "geometry/triangulate.hpp"
#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <utility>

#include <octosurf/pieces.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

using namespace planning;

// m between a piece and its boundary: more than repeated rounding in reshaped() can move an edge (a µm each
// time).
constexpr double clear_of = 2e-5;
// Number of the largest triangles tried as seeds of a piece: four times as many cover the floors of the
// office and stones maps equally within 0.4 %. 25 times as many, with every piece grown anew three times,
// cover 71.1 % instead of 70.8 % of the floor around twenty stones, at 25 times the cost. The floor's shape
// is the limit: 24 pieces cover 81 % of it, 48 89 %, 96 96 %.
constexpr std::size_t seeds = 12;
// Limit of effort; growing normally ends when a round adds less than a thousandth.
constexpr int rounds = 10;
// Pieces are omitted if all allowed ones of the same size would add less than this to the region.
constexpr double negligible_share = 0.02;

using RegionSegment = std::pair<Eigen::Vector2d, Eigen::Vector2d>;

struct HalfPlane {
  Eigen::Vector2d normal;  // unit, outward
  double offset = 0;
};

/// Area, centroid and second moments about it, of a convex ring.
struct Moments {
  double area = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
};

Moments moments_of(const Ring2& ring) {
  Moments sum;
  const Eigen::Vector2d origin = ring.front();
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
    const Eigen::Vector2d a = ring[i] - origin, b = ring[i + 1] - origin;
    const double area = (a.x() * b.y() - a.y() * b.x()) / 2;
    sum.area += area;
    sum.centroid += area * (a + b) / 3;
    // A triangle's second moments about its corner.
    sum.second +=
        area / 12 * (2 * a * a.transpose() + 2 * b * b.transpose() + a * b.transpose() + b * a.transpose());
  }
  if (sum.area <= 0) return sum;
  sum.centroid /= sum.area;
  sum.second = sum.second / sum.area - sum.centroid * sum.centroid.transpose();
  sum.centroid += origin;
  return sum;
}

/// The half planes that exclude edges, tangent to the ellipses |to_circle · (x − centre)| = r where these
/// first meet an edge: nearest edges first, those excluded already are skipped (IRIS, Deits and Tedrake
/// 2014).
std::vector<HalfPlane> separating(const std::vector<RegionSegment>& edges, const Eigen::Vector2d& centre,
                                  const Eigen::Matrix2d& to_circle) {
  struct Near {
    RegionSegment edge;
    Eigen::Vector2d closest;
  };
  std::vector<Near> left;
  left.reserve(edges.size());
  for (const auto& [from, to] : edges) {
    const RegionSegment edge{to_circle * (from - centre), to_circle * (to - centre)};
    left.push_back({edge, closest_on_segment(edge.first, edge.second, Eigen::Vector2d::Zero())});
  }
  std::vector<HalfPlane> planes;
  while (!left.empty()) {
    const auto nearest = std::min_element(left.begin(), left.end(), [](const Near& a, const Near& b) {
      return a.closest.squaredNorm() < b.closest.squaredNorm();
    });
    const Eigen::Vector2d touch = nearest->closest;
    const double r2 = touch.squaredNorm();
    *nearest = left.back();
    left.pop_back();
    // Tolerance, so that neighbours that share the vertex count as beyond.
    const double beyond = r2 * (1 - 1e-12);
    std::erase_if(left, [&](const Near& near) {
      return near.edge.first.dot(touch) >= beyond && near.edge.second.dot(touch) >= beyond;
    });
    const Eigen::Vector2d normal = to_circle.transpose() * touch;
    const double length = normal.norm();
    if (length > 0) planes.push_back({normal / length, (r2 + normal.dot(centre)) / length});
  }
  return planes;
}

struct Grown {
  Ring2 ring;             ///< clear of the edges
  Ring2 up_to_the_edges;  ///< area to remove from the part, so that the rest is clear of the ring
  double area = 0;
};

Ring2 intersection(Ring2 ring, const std::vector<HalfPlane>& planes, double inward) {
  for (const HalfPlane& plane : planes) {
    ring = cut(ring, [&, offset = plane.offset - inward](const Eigen::Vector2d& p) {
      return plane.normal.dot(p) - offset;
    });
    if (ring.size() < 3) return {};
  }
  return ring;
}

/// A large convex ring around a point inside: an ellipse grown repeatedly, adopting the shape of the ring
/// before.
Grown grown_from(const std::vector<RegionSegment>& edges, const Ring2& box, Eigen::Vector2d centre) {
  Eigen::Matrix2d to_circle = Eigen::Matrix2d::Identity();
  Grown best;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<HalfPlane> planes = separating(edges, centre, to_circle);
    Ring2 ring = intersection(box, planes, clear_of);
    if (ring.size() < 3) break;
    const Moments moments = moments_of(ring);
    if (moments.area <= best.area * 1.001) break;
    best = {std::move(ring), intersection(box, planes, 0), moments.area};
    centre = moments.centroid;
    const Eigen::LLT<Eigen::Matrix2d> root(moments.second);
    if (root.info() != Eigen::Success) break;
    to_circle = root.matrixL().solve(Eigen::Matrix2d::Identity());
  }
  return best;
}

/// A remaining part of the region, and the largest piece found in it.
struct RegionPart {
  Polygon polygon;
  Grown best;
};

RegionPart part_of(Polygon polygon) {
  std::vector<RegionSegment> edges;
  for_each_edge({polygon},
                [&edges](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { edges.emplace_back(a, b); });
  const Ring2 box = ring_of(box_of(polygon.outer));
  std::vector<Eigen::Vector2d> points;
  std::vector<std::pair<double, Eigen::Vector2d>> starts;
  for (const auto& t : geometry::triangulate(polygon, points)) {
    const Ring2 triangle{points[t[0]], points[t[1]], points[t[2]]};
    starts.emplace_back(geometry::signed_area(triangle), (triangle[0] + triangle[1] + triangle[2]) / 3);
  }
  const std::size_t tried = std::min(seeds, starts.size());
  std::partial_sort(starts.begin(), starts.begin() + static_cast<std::ptrdiff_t>(tried), starts.end(),
                    [](const auto& a, const auto& b) { return a.first > b.first; });
  RegionPart part{std::move(polygon), {}};
  for (std::size_t i = 0; i < tried; ++i) {
    const Eigen::Vector2d& start = starts[i].second;
    // A seed inside the best piece would lead to it again.
    if (!part.best.ring.empty() && depth_in(part.best.ring, start) > 0) continue;
    Grown grown = grown_from(edges, box, start);
    if (grown.area > part.best.area) part.best = std::move(grown);
  }
  return part;
}

/// The minimum distance between two parallels that enclose a convex ring.
double width_of(const Ring2& ring) {
  double width = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d along = (ring[(i + 1) % ring.size()] - ring[i]).normalized();
    double farthest = 0;
    for (const Eigen::Vector2d& p : ring) {
      const Eigen::Vector2d v = p - ring[i];
      farthest = std::max(farthest, along.x() * v.y() - along.y() * v.x());
    }
    width = std::min(width, farthest);
  }
  return width;
}

/// Without nearly straight corners: the result is contained in the original.
Ring2 tidied(Ring2 ring) {
  Ring2 kept;
  for (const Eigen::Vector2d& p : ring)
    if (kept.empty() || (p - kept.back()).norm() > clear_of) kept.push_back(p);
  while (kept.size() > 1 && (kept.front() - kept.back()).norm() <= clear_of) kept.pop_back();
  return convex_hull(std::move(kept));
}

/// With counter-clockwise corners.
ConvexPiece piece_of(const Surface& surface, const Ring2& corners) {
  const auto n = static_cast<Eigen::Index>(corners.size());
  ConvexPiece piece;
  piece.A.resize(n, 2);
  piece.b.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector2d& from = corners[static_cast<std::size_t>(i)];
    const Eigen::Vector2d along = (corners[static_cast<std::size_t>((i + 1) % n)] - from).normalized();
    piece.A.row(i) << along.y(), -along.x();
    // The maximum over all corners, not the edge's own value: rounding never excludes a corner.
    piece.b[i] = piece.A.row(i).dot(from);
    for (const Eigen::Vector2d& corner : corners)
      piece.b[i] = std::max(piece.b[i], piece.A.row(i).dot(corner));
    piece.vertices.push_back(surface.to_map(from));
  }
  return piece;
}

}  // namespace

std::vector<ConvexPiece> convex_pieces(const Surface& surface, const std::vector<Polygon>& polygons,
                                       std::size_t most, double min_area_m2) {
  if (most == 0) return {};
  const double least =
      std::max(min_area_m2, negligible_share * area_of(polygons) / static_cast<double>(most));
  std::vector<Ring2> rings;
  std::vector<RegionPart> parts;
  const auto add = [&](const std::vector<Polygon>& some) {
    for (const Polygon& polygon : some) {
      if (geometry::area_of(polygon) < least) continue;
      RegionPart part = part_of(polygon);
      if (part.best.area >= least && part.best.area > 0) parts.push_back(std::move(part));
    }
  };
  add(polygons);
  while (rings.size() < most && !parts.empty()) {
    const auto largest =
        std::max_element(parts.begin(), parts.end(),
                         [](const RegionPart& a, const RegionPart& b) { return a.best.area < b.best.area; });
    const RegionPart part = std::move(*largest);
    parts.erase(largest);
    Ring2 ring = tidied(part.best.ring);
    // A surface is not accurate to a small part of its voxels; but the first piece is made even if narrow.
    if (ring.size() < 3 || (!rings.empty() && width_of(ring) < surface.resolution / 4)) continue;
    rings.push_back(std::move(ring));
    if (rings.size() < most) add(reshaped({&part.polygon, 1}, {}, {&part.best.up_to_the_edges, 1}));
  }
  // They usually are sorted; but a piece found in a part may exceed the one found in the whole.
  std::stable_sort(rings.begin(), rings.end(), [](const Ring2& a, const Ring2& b) {
    return geometry::signed_area(a) > geometry::signed_area(b);
  });
  std::vector<ConvexPiece> pieces;
  for (const Ring2& ring : rings) pieces.push_back(piece_of(surface, ring));
  return pieces;
}

PlannerSurface turned(PlannerSurface surface, const Eigen::Quaterniond& turn) {
  surface.T_world_surface = turn * surface.T_world_surface;
  for (ConvexPiece& piece : surface.pieces)
    for (Eigen::Vector3d& vertex : piece.vertices) vertex = turn * vertex;
  return surface;
}

std::vector<PlannerSurface> planner_surfaces(const Snapshot& snapshot, const PlannerContact& contact,
                                             const OccupancyView* octree) {
  std::vector<PlannerSurface> surfaces;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    ContactRegion region =
        contact_region(*surface, contact.shape, contact.yaw_rad, contact.limits, octree, &snapshot);
    PlannerSurface one{surface->id, surface->T_map_surface, surface->polygons, {}, {}};
    one.pieces = convex_pieces(*surface, region.polygons, contact.pieces);
    one.insets = std::move(region.polygons);
    surfaces.push_back(turned(std::move(one), contact.turn));
  }
  return surfaces;
}

}  // namespace octosurf
