#include "io/exporters/planner_messages.hpp"

#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"
#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf {
namespace {

using GridLayers = std::vector<std::pair<std::string, const Eigen::MatrixXf*>>;
constexpr double steepest_rad = 80 * std::numbers::pi / 180;

/// std_msgs/MultiArrayDimension.
void write_dimension(io::MessageWriter& out, const char* label, Eigen::Index size, Eigen::Index stride) {
  out.message("label", label, "size", static_cast<std::uint32_t>(size), "stride",
              static_cast<std::uint32_t>(stride));
}

/// std_msgs/Float32MultiArray, labelled column by column as grid_map's GridMapMsgHelpers requires.
void write_layer(io::MessageWriter& out, const Eigen::MatrixXf& layer) {
  const auto dimensions = [&layer](io::MessageWriter& to) {
    to.begin_list(2);
    write_dimension(to, "column_index", layer.cols(), layer.size());
    write_dimension(to, "row_index", layer.rows(), layer.rows());
  };
  out.message("layout", io::message_of("dim", dimensions, "data_offset", std::uint32_t{0}), "data",
              std::span<const float>(layer.data(), static_cast<std::size_t>(layer.size())));
}

/// std_msgs/Header, a field's value. A map is of no one moment, so its time is 0 unless one is given.
auto header(const std::string& frame, std::int64_t stamp_ns) {
  return [frame, stamp_ns](io::MessageWriter& out) {
    constexpr std::int64_t second = 1000000000;
    const std::int64_t nanoseconds = (stamp_ns % second + second) % second;  // from 0 on, before 1970 too
    out.message("stamp",
                io::message_of("sec", static_cast<std::int32_t>((stamp_ns - nanoseconds) / second), "nanosec",
                               static_cast<std::uint32_t>(nanoseconds)),
                "frame_id", frame);
  };
}

/// grid_map_msgs/GridMap with these layers of the grid's size.
void write_grid_map(io::MessageWriter& out, const HeightGrid& grid, const GridLayers& layers,
                    const std::string& frame, std::int64_t stamp_ns) {
  const Eigen::Isometry3d center(Eigen::Translation3d(grid.center.x(), grid.center.y(), 0));
  const auto write_name = [](io::MessageWriter& to, const auto& layer) { to.write(layer.first); };
  // ROS 1 has the header in `info`, ROS 2 before it; serialised, both are the same.
  out.message(
      "info",
      io::message_of("header", header(frame, stamp_ns), "resolution", grid.cell, "length_x",
                     grid.cell * static_cast<double>(grid.elevation.rows()), "length_y",
                     grid.cell * static_cast<double>(grid.elevation.cols()), "pose", center),
      "layers", io::each(layers, write_name),
      // Where these are NaN, a cell is not valid.
      "basic_layers", std::vector<std::string>{"elevation"}, "data",
      io::each(layers, [](io::MessageWriter& to, const auto& layer) { write_layer(to, *layer.second); }),
      "outer_start_index", std::uint16_t{0}, "inner_start_index", std::uint16_t{0});
}

/// Throws Error(data) unless the grid has cells and all its layers are of one size.
void require_cells(const HeightGrid& grid, const char* message) {
  if (grid.elevation.size() == 0)
    throw Error(Error::Kind::data, message, "there is nothing to put into it",
                "no surface is level enough; a larger slope leaves more, and --up where z is not up");
  const auto same = [&](const Eigen::MatrixXf& layer) {
    return layer.rows() == grid.elevation.rows() && layer.cols() == grid.elevation.cols();
  };
  if (!same(grid.surface) || !std::ranges::all_of(grid.normal, same))
    throw Error(Error::Kind::data, message, "the grid's layers differ in size", "use height_grid()");
}

GridLayers layers_of(const HeightGrid& grid) {
  return {{"elevation", &grid.elevation},
          {"normal_x", &grid.normal[0]},
          {"normal_y", &grid.normal[1]},
          {"normal_z", &grid.normal[2]},
          {"surface_id", &grid.surface}};
}

/// A point strictly inside: an inset's corners may lie on the outline.
Eigen::Vector2d interior_point(const Polygon& polygon) {
  std::vector<Eigen::Vector2d> v;
  const auto triangles = geometry::triangulate(polygon, v);
  const auto area = [&](const auto& t) { return geometry::signed_area({v[t[0]], v[t[1]], v[t[2]]}); };
  const auto widest =
      std::ranges::max_element(triangles, [&](const auto& a, const auto& b) { return area(a) < area(b); });
  if (widest == triangles.end())
    throw Error(Error::Kind::data, "polygon", "has no area", "build the map anew from its scans");
  return (v[(*widest)[0]] + v[(*widest)[1]] + v[(*widest)[2]]) / 3;
}

std::vector<io::TerrainRegion> regions_of(const PlannerSurface& surface) {
  std::vector<io::TerrainRegion> regions;
  for (const Polygon& polygon : surface.polygons) regions.push_back({&surface, &polygon, {}});
  for (const Polygon& inset : surface.insets) {
    const Eigen::Vector2d point = interior_point(inset);
    const auto with = std::ranges::find_if(regions, [&](const io::TerrainRegion& region) {
      const auto holds = [&](const Ring2& ring) { return geometry::inside(ring, point); };
      const Polygon& polygon = *region.boundary;
      return holds(polygon.outer) && std::ranges::none_of(polygon.holes, holds);
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

std::string grid_map_message(const HeightGrid& grid, const std::string& frame, std::int64_t stamp_ns) {
  require_cells(grid, "grid map");
  return io::cdr_of(
      [&](io::MessageWriter& out) { write_grid_map(out, grid, layers_of(grid), frame, stamp_ns); });
}

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
    write_grid_map(to, grid, {{"elevation", &elevation}, {"smooth_planar", &smooth}}, frame, stamp_ns);
  };
  out.message("planarRegions", io::each(regions, write_region), "gridmap", write_grid);
}

std::string planar_terrain_message(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                   const std::string& frame, std::int64_t stamp_ns, bool or_empty) {
  require_cells(grid, "planar terrain");
  const std::vector<io::TerrainRegion> regions = io::terrain_regions(surfaces);
  if (regions.empty() && !or_empty)
    throw Error(Error::Kind::data, "planar terrain", "there is nothing to put into it",
                "no surface has room for the contact; a smaller foot or a larger slope leaves more");
  return io::cdr_of(
      [&](io::MessageWriter& out) { io::write_planar_terrain(out, regions, grid, frame, stamp_ns); });
}

}  // namespace octosurf
