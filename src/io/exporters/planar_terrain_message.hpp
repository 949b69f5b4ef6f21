#pragma once

#include "io/exporters/message_writer.hpp"

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

struct TerrainRegions {
  std::vector<TerrainRegion> regions;
  PlanarTerrainCount count;
};

/// What export_planar_terrain() writes of the surfaces, which must outlive it.
TerrainRegions terrain_regions(const std::vector<PlannerSurface>& surfaces);

/// convex_plane_decomposition_msgs/PlanarTerrain as export_planar_terrain() describes it, of a grid that has
/// cells. Without a region it is a terrain on which there is no foothold.
void write_planar_terrain(MessageWriter& out, const std::vector<TerrainRegion>& regions,
                          const HeightGrid& grid, const std::string& frame);

}  // namespace octosurf::io
