#include "io/exporters/export_formats.hpp"
#include "io/exporters/grid_map_message.hpp"

#include <algorithm>

#include <octosurf/error.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf {
namespace {

/// std_msgs/MultiArrayDimension.
void write_dimension(io::MessageWriter& out, const std::string& label, Eigen::Index size,
                     Eigen::Index stride) {
  out.begin_message();
  out.field("label", label);
  out.field("size", static_cast<std::uint32_t>(size));
  out.field("stride", static_cast<std::uint32_t>(stride));
  out.end_message();
}

/// std_msgs/Float32MultiArray, labelled column by column as grid_map's GridMapMsgHelpers requires.
void write_layer(io::MessageWriter& out, const Eigen::MatrixXf& layer) {
  out.begin_message();
  out.field("layout");
  out.begin_message();
  out.field("dim");
  out.begin_list(2);
  write_dimension(out, "column_index", layer.cols(), layer.size());
  write_dimension(out, "row_index", layer.rows(), layer.rows());
  out.end_list();
  out.field("data_offset", std::uint32_t{0});
  out.end_message();
  out.field("data", std::span<const float>(layer.data(), static_cast<std::size_t>(layer.size())));
  out.end_message();
}

}  // namespace

void io::write_header(io::MessageWriter& out, const std::string& frame, std::int64_t stamp_ns) {
  out.begin_message();
  if (out.numbers_headers()) out.field("seq", std::uint32_t{0});
  constexpr std::int64_t second = 1000000000;
  const std::int64_t nanoseconds = (stamp_ns % second + second) % second;  // not negative, even before 1970
  out.field("stamp");
  out.begin_message();
  out.field("sec", static_cast<std::int32_t>((stamp_ns - nanoseconds) / second));
  out.field("nanosec", static_cast<std::uint32_t>(nanoseconds));
  out.end_message();
  out.field("frame_id", frame);
  out.end_message();
}

void io::write_point(io::MessageWriter& out, const Eigen::Vector3d& point) {
  out.begin_message();
  out.field("x", point.x());
  out.field("y", point.y());
  out.field("z", point.z());
  out.end_message();
}

void io::write_pose(io::MessageWriter& out, const Eigen::Vector3d& position,
                    const Eigen::Quaterniond& orientation) {
  out.begin_message();
  out.field("position");
  io::write_point(out, position);
  out.field("orientation");
  out.begin_message();
  out.field("x", orientation.x());
  out.field("y", orientation.y());
  out.field("z", orientation.z());
  out.field("w", orientation.w());
  out.end_message();
  out.end_message();
}

void io::write_grid_map(io::MessageWriter& out, const HeightGrid& grid, const io::GridLayers& layers,
                        const std::string& frame) {
  out.begin_message();
  // ROS 1 has the header in `info`, ROS 2 before it; serialised, both are the same.
  out.field("info");
  out.begin_message();
  out.field("header");
  io::write_header(out, frame);
  out.field("resolution", grid.cell);
  out.field("length_x", grid.cell * static_cast<double>(grid.elevation.rows()));
  out.field("length_y", grid.cell * static_cast<double>(grid.elevation.cols()));
  out.field("pose");
  io::write_pose(out, {grid.center.x(), grid.center.y(), 0}, Eigen::Quaterniond::Identity());
  out.end_message();
  out.field("layers");
  out.begin_list(layers.size());
  for (const auto& [name, layer] : layers) out.write(name);
  out.end_list();
  out.field("basic_layers");  // a cell is invalid where these are NaN
  out.begin_list(1);
  out.write(std::string("elevation"));
  out.end_list();
  out.field("data");
  out.begin_list(layers.size());
  for (const auto& [name, layer] : layers) write_layer(out, *layer);
  out.end_list();
  out.field("outer_start_index", std::uint16_t{0});
  out.field("inner_start_index", std::uint16_t{0});
  out.end_message();
}

void io::require_cells(const HeightGrid& grid, const std::filesystem::path& file) {
  if (grid.elevation.size() == 0)
    throw Error(Error::Kind::data, file.string(), "there is nothing to put into it",
                "no surface is level enough; a larger slope leaves more, and --up where z is not up");
  const auto same = [&](const Eigen::MatrixXf& layer) {
    return layer.rows() == grid.elevation.rows() && layer.cols() == grid.elevation.cols();
  };
  if (!same(grid.surface) || !std::all_of(grid.normal.begin(), grid.normal.end(), same))
    throw Error(Error::Kind::data, file.string(), "the grid's layers differ in size", "use height_grid()");
}

io::GridLayers io::layers_of(const HeightGrid& grid) {
  return {{"elevation", &grid.elevation},
          {"normal_x", &grid.normal[0]},
          {"normal_y", &grid.normal[1]},
          {"normal_z", &grid.normal[2]},
          {"surface_id", &grid.surface}};
}

void export_grid_map(const HeightGrid& grid, const std::string& frame, const std::filesystem::path& file,
                     bool force) {
  io::require_cells(grid, file);
  io::write_message(
      [&](io::MessageWriter& out) { io::write_grid_map(out, grid, io::layers_of(grid), frame); }, file,
      force);
}

std::string grid_map_message(const HeightGrid& grid, const std::string& frame, MessageEncoding encoding) {
  io::require_cells(grid, "grid map");
  return io::message_bytes(
      [&](io::MessageWriter& out) { io::write_grid_map(out, grid, io::layers_of(grid), frame); }, encoding);
}

}  // namespace octosurf
