#include "io/exporters/export_formats.hpp"
#include "io/exporters/grid_map_message.hpp"
#include "io/exporters/planar_terrain_message.hpp"
#include "io/exporters/planner_pieces.hpp"
#include "io/exporters/terrain_layers.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf {
namespace {

constexpr double steepest_rad = 80 * std::numbers::pi / 180;

std::vector<io::TerrainRegion> regions_of(const PlannerSurface& surface) {
  std::vector<io::TerrainRegion> regions;
  for (const Polygon& polygon : surface.polygons) regions.push_back({&surface, &polygon, {}});
  for (const Polygon& inset : surface.insets) {
    const std::size_t at = io::polygon_with(surface.polygons, io::interior_point(inset));
    if (at < regions.size()) regions[at].insets.push_back(&inset);
  }
  return regions;
}

void write_region(io::MessageWriter& out, const io::TerrainRegion& region) {
  const auto write_vertex = [&region](io::MessageWriter& to, const Eigen::Vector2d& uv) {
    io::finite(uv.sum(), region.surface->id);
    to.message("x", static_cast<float>(uv.x()), "y", static_cast<float>(uv.y()));
  };
  const auto write_ring = [&](io::MessageWriter& to, const Ring2& ring) {
    to.message("points", io::each(ring, write_vertex));
  };
  const auto write_polygon = [&](io::MessageWriter& to, const Polygon& polygon) {
    to.message("outer_boundary", io::one(polygon.outer, write_ring), "holes",
               io::each(polygon.holes, write_ring));
  };
  Eigen::AlignedBox2f box;
  for (const Eigen::Vector2d& uv : region.boundary->outer) box.extend(uv.cast<float>());
  const Eigen::Vector2f &low = box.min(), &high = box.max();
  out.message("plane_parameters", region.surface->T_world_surface, "bbox2d",
              io::message_of("min_x", low.x(), "min_y", low.y(), "max_x", high.x(), "max_y", high.y()),
              "boundary", io::one(*region.boundary, write_polygon), "insets",
              io::each(region.insets, write_polygon));
}

/// Regions of a terrain that must not be empty. `where` names it in errors.
io::TerrainRegions some_regions(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                const std::filesystem::path& where) {
  io::require_cells(grid, where);
  io::TerrainRegions terrain = io::terrain_regions(surfaces);
  if (terrain.regions.empty())
    throw Error(Error::Kind::data, where.string(), "there is nothing to put into it",
                "no surface has room for the contact; a smaller foot or a larger slope leaves more, "
                "and --up where z is not up");
  return terrain;
}

}  // namespace

io::TerrainRegions io::terrain_regions(const std::vector<PlannerSurface>& surfaces) {
  io::TerrainRegions usable;
  for (const PlannerSurface& surface : surfaces) {
    if (surface.T_world_surface(2, 2) < std::cos(steepest_rad)) {
      usable.count.too_steep += surface.polygons.size();
      continue;
    }
    for (io::TerrainRegion& region : regions_of(surface)) {
      usable.count.without_inset += region.insets.empty();
      if (!region.insets.empty()) usable.regions.push_back(std::move(region));
    }
  }
  usable.count.regions = usable.regions.size();
  return usable;
}

void io::write_planar_terrain(io::MessageWriter& out, const std::vector<io::TerrainRegion>& regions,
                              const HeightGrid& grid, const std::string& frame) {
  const Eigen::MatrixXf elevation = io::without_gaps(grid.elevation);
  const Eigen::MatrixXf smooth = io::mean_over(elevation, 0.2 / grid.cell);
  const auto write_grid = [&](io::MessageWriter& to) {
    io::write_grid_map(to, grid, {{"elevation", &elevation}, {"smooth_planar", &smooth}}, frame);
  };
  out.message("planarRegions", io::each(regions, write_region), "gridmap", write_grid);
}

PlanarTerrainCount export_planar_terrain(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                         const std::string& frame, const std::filesystem::path& file,
                                         bool force) {
  const io::TerrainRegions terrain = some_regions(surfaces, grid, file);
  io::write_message(
      [&](io::MessageWriter& out) { io::write_planar_terrain(out, terrain.regions, grid, frame); }, file,
      force);
  return terrain.count;
}

std::string planar_terrain_message(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                   const std::string& frame, MessageEncoding encoding) {
  const io::TerrainRegions terrain = some_regions(surfaces, grid, "planar terrain");
  return io::message_bytes(
      [&](io::MessageWriter& out) { io::write_planar_terrain(out, terrain.regions, grid, frame); }, encoding);
}

}  // namespace octosurf
