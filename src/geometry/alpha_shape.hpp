#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Polygons of the paper's alpha shape (IV-A, Algorithm 3): Delaunay triangulation, triangles with
/// a side over `alpha` dropped, boundary of what is left.
///
/// 1. Rings are simple; a vertex at which a boundary meets itself belongs to several rings.
/// 2. Outer rings counter-clockwise, holes clockwise; islands in holes are polygons of their own.
/// 3. Every edge is at most `alpha` long.
/// Duplicate and collinear points are fine; fewer than three distinct points give no polygon.
/// The result does not depend on the points' order, ties between cocircular points included. Rings
/// begin at their lexicographically smallest vertex; holes and polygons are in the order of their rings.
/// Cost O(n log n); about 3 µs a point. Outline keeps the same up to date while points come and go.
std::vector<Polygon> alpha_shape(std::span<const Eigen::Vector2d> points, double alpha);

/// Area of a polygon with its holes taken off, m².
double area_of(const Polygon& polygon);
/// Signed area of a ring, positive if counter-clockwise.
double signed_area(const Ring2& ring);

/// Drops near-collinear vertices, moving the outline by at most `tolerance`; keeps rings simple and
/// apart (topology-preserving, Dyken et al. 2009, CGAL Polyline_simplification_2).
std::vector<Polygon> simplify(const std::vector<Polygon>& polygons, double tolerance);

}  // namespace octosurf
