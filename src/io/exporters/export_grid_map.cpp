#include "io/exporters/planner_messages.hpp"

#include <algorithm>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf {
namespace {

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

}  // namespace

std::function<void(io::MessageWriter&)> io::header(const std::string& frame, std::int64_t stamp_ns) {
  return [frame, stamp_ns](io::MessageWriter& out) {
    constexpr std::int64_t second = 1000000000;
    const std::int64_t nanoseconds = (stamp_ns % second + second) % second;  // from 0 on, before 1970 too
    out.message("stamp",
                io::message_of("sec", static_cast<std::int32_t>((stamp_ns - nanoseconds) / second), "nanosec",
                               static_cast<std::uint32_t>(nanoseconds)),
                "frame_id", frame);
  };
}

void io::write_grid_map(io::MessageWriter& out, const HeightGrid& grid, const io::GridLayers& layers,
                        const std::string& frame, std::int64_t stamp_ns) {
  const Eigen::Isometry3d center(Eigen::Translation3d(grid.center.x(), grid.center.y(), 0));
  const auto write_name = [](io::MessageWriter& to, const auto& layer) { to.write(layer.first); };
  // ROS 1 has the header in `info`, ROS 2 before it; serialised, both are the same.
  out.message(
      "info",
      io::message_of("header", io::header(frame, stamp_ns), "resolution", grid.cell, "length_x",
                     grid.cell * static_cast<double>(grid.elevation.rows()), "length_y",
                     grid.cell * static_cast<double>(grid.elevation.cols()), "pose", center),
      "layers", io::each(layers, write_name),
      // Where these are NaN, a cell is not valid.
      "basic_layers", std::vector<std::string>{"elevation"}, "data",
      io::each(layers, [](io::MessageWriter& to, const auto& layer) { write_layer(to, *layer.second); }),
      "outer_start_index", std::uint16_t{0}, "inner_start_index", std::uint16_t{0});
}

void io::require_cells(const HeightGrid& grid, const char* message) {
  if (grid.elevation.size() == 0)
    throw Error(Error::Kind::data, message, "there is nothing to put into it",
                "no surface is level enough; a larger slope leaves more, and --up where z is not up");
  const auto same = [&](const Eigen::MatrixXf& layer) {
    return layer.rows() == grid.elevation.rows() && layer.cols() == grid.elevation.cols();
  };
  if (!same(grid.surface) || !std::all_of(grid.normal.begin(), grid.normal.end(), same))
    throw Error(Error::Kind::data, message, "the grid's layers differ in size", "use height_grid()");
}

io::GridLayers io::layers_of(const HeightGrid& grid) {
  return {{"elevation", &grid.elevation},
          {"normal_x", &grid.normal[0]},
          {"normal_y", &grid.normal[1]},
          {"normal_z", &grid.normal[2]},
          {"surface_id", &grid.surface}};
}

std::string grid_map_message(const HeightGrid& grid, const std::string& frame, std::int64_t stamp_ns) {
  io::require_cells(grid, "grid map");
  return io::cdr_of(
      [&](io::MessageWriter& out) { io::write_grid_map(out, grid, io::layers_of(grid), frame, stamp_ns); });
}

}  // namespace octosurf
