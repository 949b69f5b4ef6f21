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
/// Cost O(n log n). The slow twin of Outline (geometry/outline.hpp), which keeps the same up to date while
/// points come and go.
std::vector<Polygon> alpha_shape(std::span<const Eigen::Vector2d> points, double alpha);

}  // namespace octosurf
