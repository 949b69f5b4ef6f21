#pragma once

#include "io/exporters/message_writer.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/height_grid.hpp>

namespace octosurf::io {

using GridLayers = std::vector<std::pair<std::string, const Eigen::MatrixXf*>>;

/// grid_map_msgs/GridMap with these layers of the grid's size.
void write_grid_map(MessageWriter& out, const HeightGrid& grid, const GridLayers& layers,
                    const std::string& frame);

/// The layers of export_grid_map(), taken from the grid.
GridLayers layers_of(const HeightGrid& grid);

/// std_msgs/Header. The time is 0 unless given, because a map has no single time.
void write_header(MessageWriter& out, const std::string& frame, std::int64_t stamp_ns = 0);

/// geometry_msgs/Point, Vector3.
void write_point(MessageWriter& out, const Eigen::Vector3d& point);

/// geometry_msgs/Pose.
void write_pose(MessageWriter& out, const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation);

/// Throws Error(data) unless the grid has cells and all its layers are of one size.
void require_cells(const HeightGrid& grid, const std::filesystem::path& file);

}  // namespace octosurf::io
