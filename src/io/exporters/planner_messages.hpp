#pragma once

#include "io/exporters/message_writer.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include <octosurf/height_grid.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf::io {

/// One region of the message: a polygon of a surface and the insets in it. Points into the surfaces.
struct TerrainRegion {
  const PlannerSurface* surface;
  const Polygon* boundary;
  std::vector<const Polygon*> insets;
};

/// The regions that planar_terrain_message() has of the surfaces, which must outlive them.
std::vector<TerrainRegion> terrain_regions(const std::vector<PlannerSurface>& surfaces);

/// convex_plane_decomposition_msgs/PlanarTerrain as in planar_terrain_message(), with a grid that has cells.
/// Without regions it is a terrain without footholds.
void write_planar_terrain(MessageWriter& out, const std::vector<TerrainRegion>& regions,
                          const HeightGrid& grid, const std::string& frame, std::int64_t stamp_ns = 0);

/// Gaps (NaN) get the lowest height on their boundary.
Eigen::MatrixXf without_gaps(Eigen::MatrixXf heights);

/// Means over squares of `cells` to an edge, less at the border.
Eigen::MatrixXf mean_over(const Eigen::MatrixXf& heights, double cells);

}  // namespace octosurf::io
