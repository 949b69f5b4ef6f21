#pragma once

#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// Drops near-collinear vertices, moving the outline by at most `tolerance`; keeps rings simple and
/// apart (topology-preserving, Dyken et al. 2009, CGAL Polyline_simplification_2).
std::vector<Polygon> simplify(const std::vector<Polygon>& polygons, double tolerance);

}  // namespace octosurf::geometry
