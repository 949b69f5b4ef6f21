#pragma once

#include <cstddef>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Twice the area of the triangle (0, a, b); positive where b lies to the left of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Calls `visit(from, to)` for every edge of every ring.
template <typename Visit>
void for_each_edge(const Polygon& polygon, const Visit& visit) {
  const auto ring = [&](const Ring2& vertices) {
    for (std::size_t i = 0; i < vertices.size(); ++i) visit(vertices[i], vertices[(i + 1) % vertices.size()]);
  };
  ring(polygon.outer);
  for (const Ring2& hole : polygon.holes) ring(hole);
}

/// Even-odd rule; undefined on an edge. O(n).
bool contains(const Polygon& polygon, const Eigen::Vector2d& point);

/// The point of the segment that is nearest to `point`.
Eigen::Vector2d closest_on_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                   const Eigen::Vector2d& point);

/// The part of a ring in a box (Sutherland and Hodgman 1974). Where the ring leaves the box and comes back,
/// its parts are joined along the box's sides, so that winding numbers inside are the ring's. O(n).
Ring2 clipped(const Ring2& ring, const Eigen::AlignedBox2d& box);
std::vector<Polygon> clipped(const std::vector<Polygon>& polygons, const Eigen::AlignedBox2d& box);

/// Of a point in a convex polygon, point or segment: distance from the nearest side; negative outside. O(n).
double depth_in(const Ring2& convex, const Eigen::Vector2d& point);

/// m², without their holes.
double area_of(const std::vector<Polygon>& polygons);

/// Of the polygons, in the surface's frame.
Eigen::AlignedBox2d box_of(const Surface& surface);

/// Whether frame and polygons are equal, to the bit.
bool same_outline(const Surface& a, const Surface& b);

/// The surface with other polygons, and `boundary` and `area_m2` that go with them. Edges are divided where
/// they are longer than the surface's longest: readers rely on neighbours in a ring being at most h apart.
SurfacePtr with_outline(const Surface& surface, std::vector<Polygon> polygons);

}  // namespace octosurf::planning
