#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::simulation {

using Segment2 = std::array<Eigen::Vector2d, 2>;

/// The cells into which segments cut a plane, put together where `inside` holds of them: outer rings
/// counter-clockwise, holes clockwise, exact but for `tolerance` (CGAL's arrangement of exact numbers).
///
/// 1. End points within `tolerance` (m) of each other or of a segment are one, so that what touches at a T
/// closes.
/// 2. A cell is asked about at the middles of its three largest triangles; one that is inside is enough.
/// 3. Polygons and holes narrower than twice the tolerance are left out.
std::vector<Polygon> cells_where(const std::vector<Segment2>& segments, double tolerance,
                                 const std::function<bool(const Eigen::Vector2d&)>& inside);

}  // namespace octosurf::simulation
