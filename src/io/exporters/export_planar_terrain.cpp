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

void write_terrain_ring(io::MessageWriter& out, const Ring2& ring, SurfaceId id) {
  out.begin_message();
  out.field("points");
  out.begin_list(ring.size());
  for (const Eigen::Vector2d& uv : ring) {
    io::finite(uv.sum(), id);
    out.begin_message();
    out.field("x", static_cast<float>(uv.x()));
    out.field("y", static_cast<float>(uv.y()));
    out.end_message();
  }
  out.end_list();
  out.end_message();
}

void write_polygon(io::MessageWriter& out, const Polygon& polygon, SurfaceId id) {
  out.begin_message();
  out.field("outer_boundary");
  write_terrain_ring(out, polygon.outer, id);
  out.field("holes");
  out.begin_list(polygon.holes.size());
  for (const Ring2& hole : polygon.holes) write_terrain_ring(out, hole, id);
  out.end_list();
  out.end_message();
}

void write_box(io::MessageWriter& out, const Ring2& ring) {
  Eigen::AlignedBox2f box;
  for (const Eigen::Vector2d& uv : ring) box.extend(uv.cast<float>());
  out.begin_message();
  out.field("min_x", box.min().x());
  out.field("min_y", box.min().y());
  out.field("max_x", box.max().x());
  out.field("max_y", box.max().y());
  out.end_message();
}

void write_region(io::MessageWriter& out, const io::TerrainRegion& region) {
  const SurfaceId id = region.surface->id;
  const Eigen::Isometry3d& pose = region.surface->T_world_surface;
  out.begin_message();
  out.field("plane_parameters");
  io::write_pose(out, pose.translation(), Eigen::Quaterniond(pose.linear()));
  out.field("bbox2d");
  write_box(out, region.boundary->outer);
  out.field("boundary");
  write_polygon(out, *region.boundary, id);
  out.field("insets");
  out.begin_list(region.insets.size());
  for (const Polygon* inset : region.insets) write_polygon(out, *inset, id);
  out.end_list();
  out.end_message();
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
  out.begin_message();
  out.field("planarRegions");
  out.begin_list(regions.size());
  for (const io::TerrainRegion& region : regions) write_region(out, region);
  out.end_list();
  out.field("gridmap");
  io::write_grid_map(out, grid, {{"elevation", &elevation}, {"smooth_planar", &smooth}}, frame);
  out.end_message();
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
