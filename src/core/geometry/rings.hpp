#pragma once

#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// Left of it, or below it at the same x: the order in which a sweep from left to right meets points.
inline bool is_before(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
}

/// Starts every ring at its lexicographically smallest vertex, and sorts holes and polygons by their rings:
/// equal outlines give equal bytes.
void order_rings(std::vector<Polygon>& polygons);

/// Groups the rings of one outline, in any order, into polygons: outer ones counter-clockwise, holes
/// clockwise, none crossing another. A hole and its outer ring share at most one vertex. Ordered. Cost
/// O(vertices), and O(vertices of an outer ring) for every hole in the box of several outer rings.
std::vector<Polygon> polygons_of(std::vector<Ring2> rings);

/// Sets a surface's polygons, with its boundary and area.
void set_polygons(Surface& surface, std::vector<Polygon> polygons);

/// Signed area of a ring, positive if counter-clockwise.
double signed_area(const Ring2& ring);
/// Area of a polygon without its holes, m².
double area_of(const Polygon& polygon);

}  // namespace octosurf::geometry
