#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Twice the area of the triangle (0, a, b); positive where b lies to the left of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// A box, and so much more on every side.
template <int dimension>
Eigen::AlignedBox<double, dimension> box_about(const Eigen::AlignedBox<double, dimension>& box,
                                               double reach) {
  return {(box.min().array() - reach).matrix(), (box.max().array() + reach).matrix()};
}
inline Eigen::AlignedBox2d box_about(const Eigen::Vector2d& at, double reach) {
  return box_about(Eigen::AlignedBox2d(at), reach);
}
inline Eigen::AlignedBox2d box_of(const Ring2& ring) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : ring) box.extend(p);
  return box;
}
/// About part of a plane, between two heights over it.
inline Eigen::AlignedBox3d box_over(const Eigen::Isometry3d& T, const Eigen::AlignedBox2d& part, double from,
                                    double to) {
  Eigen::AlignedBox3d box;
  box.min() << part.min(), from;
  box.max() << part.max(), to;
  return box.transformed(T);
}
/// The box's corners, counter-clockwise.
inline Ring2 ring_of(const Eigen::AlignedBox2d& box) {
  const Eigen::Vector2d &low = box.min(), &high = box.max();
  return {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
}

inline Ring2 moved(Ring2 ring, const Eigen::Vector2d& by) {
  for (Eigen::Vector2d& p : ring) p += by;
  return ring;
}
/// Calls `visit(ring)` for every ring.
template <class Polygons, typename Visit>
void for_each_ring(Polygons& polygons, const Visit& visit) {
  for (auto& polygon : polygons) {
    visit(polygon.outer);
    for (auto& hole : polygon.holes) visit(hole);
  }
}
/// Calls `visit(from, to)` for every edge of every ring.
template <typename Visit>
void for_each_edge(const std::vector<Polygon>& polygons, const Visit& visit) {
  for_each_ring(polygons, [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) visit(ring[i], ring[i + 1 < ring.size() ? i + 1 : 0]);
  });
}

/// Even-odd rule; undefined on an edge. O(n).
bool contains(const Polygon& polygon, const Eigen::Vector2d& point);

/// The point of the segment that is nearest to `point`.
Eigen::Vector2d closest_on_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                   const Eigen::Vector2d& point);

/// The part of a ring on one side of a line or plane (Sutherland and Hodgman 1974): where the distance
/// `beyond(point)` is at most 0. Where the ring leaves that side and comes back, its parts are joined along
/// the line, so that winding numbers on that side are the ring's. O(n).
template <class Point, class Beyond>
std::vector<Point> cut(const std::vector<Point>& ring, const Beyond& beyond) {
  std::vector<Point> kept;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Point &a = ring[i], &b = ring[i + 1 < ring.size() ? i + 1 : 0];
    const double of_a = beyond(a), of_b = beyond(b);
    if (of_a <= 0) kept.push_back(a);
    if ((of_a < 0 && of_b > 0) || (of_a > 0 && of_b < 0)) kept.push_back(a + of_a / (of_a - of_b) * (b - a));
  }
  return kept;
}
/// The parts in a box.
std::vector<Polygon> clipped(const std::vector<Polygon>& polygons, const Eigen::AlignedBox2d& box);

/// The union of `polygons` and `added`, without the interiors of `removed` (convex, counter-clockwise), on a
/// grid of 1 µm, in exact integer arithmetic, for any coincidences. O(n log n) in edges and their crossings,
/// some µs each. Throws Error(usage) for coordinates beyond 2 km.
std::vector<Polygon> reshaped(std::span<const Polygon> polygons, std::span<const Ring2> added,
                              std::span<const Ring2> removed);

/// Of a point in a convex polygon, point or segment: distance from the nearest side; negative outside. O(n).
double depth_in(const Ring2& convex, const Eigen::Vector2d& point);

/// m², without their holes.
double area_of(const std::vector<Polygon>& polygons);

/// Of the polygons, in the surface's frame; or moved from there.
Eigen::AlignedBox2d box_of(const Surface& surface);
Eigen::AlignedBox3d box_of(const Surface& surface, const Eigen::Isometry3d& T);

/// Whether frame and polygons are equal, to the bit.
bool same_outline(const Surface& a, const Surface& b);

/// The surface with other polygons, and `boundary` and `area_m2` that go with them. Edges are divided where
/// they are longer than the surface's longest: readers rely on neighbours in a ring being at most h apart.
SurfacePtr with_outline(const Surface& surface, std::vector<Polygon> polygons);

}  // namespace octosurf::planning
