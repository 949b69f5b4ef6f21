#pragma once

#include "io/exporters/message_writer.hpp"

#include <string>
#include <vector>

#include <octosurf/height_grid.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf {

/// convex_plane_decomposition_msgs/PlanarTerrain as export_planar_terrain() describes it, of a grid that has
/// cells. Without a region it is a terrain on which there is no foothold.
PlanarTerrainCount write_planar_terrain(MessageWriter& out, const std::vector<PlannerSurface>& surfaces,
                                        const HeightGrid& grid, const std::string& frame);

}  // namespace octosurf
