#pragma once

#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// Left of it, or below it at the same x: the order in which a sweep from left to right meets points.
inline bool is_before(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
}

/// Every ring from its lexicographically smallest vertex on, holes and polygons in the order of their
/// rings: equal outlines, equal bytes.
void order_rings(std::vector<Polygon>& polygons);

/// Polygons of the rings of one outline, in any order: outer ones counter-clockwise, holes clockwise,
/// none crossing another. Of a hole and the outer ring about it at most one vertex is shared. Ordered.
/// Cost O(vertices), and O(vertices of an outer ring) for every hole in the box of several outer rings.
std::vector<Polygon> polygons_of(std::vector<Ring2> rings);

/// Signed area of a ring, positive if counter-clockwise.
double signed_area(const Ring2& ring);
/// Area of a polygon with its holes taken off, m².
double area_of(const Polygon& polygon);

}  // namespace octosurf::geometry
