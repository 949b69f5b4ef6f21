#pragma once

#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// Removes near-collinear vertices, moving the outline by at most `tolerance`; rings stay simple and disjoint
/// (topology-preserving, Dyken et al. 2009, CGAL Polyline_simplification_2).
std::vector<Polygon> simplify(const std::vector<Polygon>& polygons, double tolerance);

}  // namespace octosurf::geometry
