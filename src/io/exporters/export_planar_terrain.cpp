#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"
#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/planner_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf {
namespace {

constexpr double steepest_rad = 80 * std::numbers::pi / 180;

/// A point strictly inside: an inset's corners may lie on the outline.
Eigen::Vector2d interior_point(const Polygon& polygon) {
  std::vector<Eigen::Vector2d> v;
  const auto triangles = geometry::triangulate(polygon, v);
  const auto area = [&](const auto& t) { return geometry::signed_area({v[t[0]], v[t[1]], v[t[2]]}); };
  const auto widest = std::max_element(triangles.begin(), triangles.end(),
                                       [&](const auto& a, const auto& b) { return area(a) < area(b); });
  if (widest == triangles.end())
    throw Error(Error::Kind::data, "polygon", "has no area", "build the map anew from its scans");
  return (v[(*widest)[0]] + v[(*widest)[1]] + v[(*widest)[2]]) / 3;
}

std::vector<io::TerrainRegion> regions_of(const PlannerSurface& surface) {
  std::vector<io::TerrainRegion> regions;
  for (const Polygon& polygon : surface.polygons) regions.push_back({&surface, &polygon, {}});
  for (const Polygon& inset : surface.insets) {
    const Eigen::Vector2d point = interior_point(inset);
    const auto with = std::find_if(regions.begin(), regions.end(), [&](const io::TerrainRegion& region) {
      const auto holds = [&](const Ring2& ring) { return geometry::inside(ring, point); };
      const Polygon& polygon = *region.boundary;
      return holds(polygon.outer) && std::none_of(polygon.holes.begin(), polygon.holes.end(), holds);
    });
    if (with != regions.end()) with->insets.push_back(&inset);
  }
  return regions;
}

/// Each row's mean with its `reach` neighbours on both sides.
Eigen::MatrixXf mean_of_rows(const Eigen::MatrixXf& heights, Eigen::Index reach) {
  Eigen::MatrixXf mean(heights.rows(), heights.cols());
  for (Eigen::Index row = 0; row < heights.rows(); ++row) {
    const Eigen::Index from = std::max<Eigen::Index>(row - reach, 0),
                       to = std::min(row + reach + 1, heights.rows());
    mean.row(row) = heights.middleRows(from, to - from).cast<double>().colwise().mean().cast<float>();
  }
  return mean;
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

}  // namespace

Eigen::MatrixXf io::without_gaps(Eigen::MatrixXf heights) {
  const Eigen::MatrixXf given = heights;
  const auto is_gap = [&](Eigen::Index cell) { return std::isnan(given(cell)); };
  std::vector<Eigen::Index> gap;  // cells, column by column
  for (Eigen::Index first = 0; first < given.size(); ++first) {
    if (!std::isnan(heights(first))) continue;
    float lowest = std::numeric_limits<float>::infinity();
    gap.assign(1, first);
    heights(first) = 0;  // seen
    for (std::size_t next = 0; next < gap.size(); ++next) {
      const Eigen::Index row = gap[next] % given.rows(), column = gap[next] / given.rows();
      for (const auto& [r, c] : std::array<std::pair<Eigen::Index, Eigen::Index>, 4>{
               {{row - 1, column}, {row + 1, column}, {row, column - 1}, {row, column + 1}}}) {
        if (r < 0 || r == given.rows() || c < 0 || c == given.cols()) continue;
        const Eigen::Index cell = c * given.rows() + r;
        if (!is_gap(cell)) {
          lowest = std::min(lowest, given(cell));
        } else if (std::isnan(heights(cell))) {
          heights(cell) = 0;
          gap.push_back(cell);
        }
      }
    }
    if (std::isinf(lowest)) return given;  // nothing but a gap
    for (const Eigen::Index cell : gap) heights(cell) = lowest;
  }
  return heights;
}

Eigen::MatrixXf io::mean_over(const Eigen::MatrixXf& heights, double cells) {
  const auto reach = static_cast<Eigen::Index>(std::min(cells / 2, static_cast<double>(heights.size())));
  return mean_of_rows(mean_of_rows(heights, reach).transpose(), reach).transpose();
}

std::vector<io::TerrainRegion> io::terrain_regions(const std::vector<PlannerSurface>& surfaces) {
  std::vector<io::TerrainRegion> usable;
  for (const PlannerSurface& surface : surfaces) {
    if (surface.T_world_surface(2, 2) < std::cos(steepest_rad)) continue;
    for (io::TerrainRegion& region : regions_of(surface))
      if (!region.insets.empty()) usable.push_back(std::move(region));
  }
  return usable;
}

void io::write_planar_terrain(io::MessageWriter& out, const std::vector<io::TerrainRegion>& regions,
                              const HeightGrid& grid, const std::string& frame, std::int64_t stamp_ns) {
  const Eigen::MatrixXf elevation = io::without_gaps(grid.elevation);
  const Eigen::MatrixXf smooth = io::mean_over(elevation, 0.2 / grid.cell);
  const auto write_grid = [&](io::MessageWriter& to) {
    io::write_grid_map(to, grid, {{"elevation", &elevation}, {"smooth_planar", &smooth}}, frame, stamp_ns);
  };
  out.message("planarRegions", io::each(regions, write_region), "gridmap", write_grid);
}

std::string planar_terrain_message(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                   const std::string& frame, std::int64_t stamp_ns, bool or_empty) {
  io::require_cells(grid, "planar terrain");
  const std::vector<io::TerrainRegion> regions = io::terrain_regions(surfaces);
  if (regions.empty() && !or_empty)
    throw Error(Error::Kind::data, "planar terrain", "there is nothing to put into it",
                "no surface has room for the contact; a smaller foot or a larger slope leaves more");
  return io::cdr_of(
      [&](io::MessageWriter& out) { io::write_planar_terrain(out, regions, grid, frame, stamp_ns); });
}

}  // namespace octosurf
