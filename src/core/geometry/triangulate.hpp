#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

/// Triangulates a polygon with holes: constrained Delaunay, counter-clockwise.
///
/// 1. `vertices` is replaced by the distinct vertices of the triangles; no ring vertex is lost and none is
///    added unless rings cross.
/// 2. Every edge of a ring is an edge of exactly one triangle, every other edge of exactly two.
/// 3. No triangle has area zero. A polygon without area gives no triangles and no vertices.
/// Rings may touch in vertices. Rings that cross (against Polygon's contract) are split at the crossings.
/// Throws Error(data) if a coordinate is not finite. Cost O(n log n).
std::vector<std::array<std::uint32_t, 3>> triangulate(const Polygon& polygon,
                                                      std::vector<Eigen::Vector2d>& vertices);

}  // namespace octosurf::geometry
