#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include <octosurf/planner_formats.hpp>

namespace octosurf::io {

/// Throws Error(data) if there is no piece, or one that is not a ring of finite points.
void require_pieces(const std::vector<PlannerSurface>& surfaces, const std::filesystem::path& file);

/// A point strictly inside. The polygon must have an area.
Eigen::Vector2d interior_point(const Polygon& polygon);

/// Index of the polygon that contains `point`, or their number if none does; undefined on a ring.
std::size_t polygon_with(const std::vector<Polygon>& polygons, const Eigen::Vector2d& point);

}  // namespace octosurf::io
