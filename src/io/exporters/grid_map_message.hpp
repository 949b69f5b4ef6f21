#pragma once

#include "io/exporters/message_writer.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/height_grid.hpp>

namespace octosurf::io {

using GridLayers = std::vector<std::pair<std::string, const Eigen::MatrixXf*>>;

/// grid_map_msgs/GridMap with these layers of the grid's size.
void write_grid_map(MessageWriter& out, const HeightGrid& grid, const GridLayers& layers,
                    const std::string& frame, std::int64_t stamp_ns = 0);

/// The layers of export_grid_map(), taken from the grid.
GridLayers layers_of(const HeightGrid& grid);

/// std_msgs/Header, a field's value. A map is of no one moment, so its time is 0 unless one is given.
std::function<void(MessageWriter&)> header(const std::string& frame, std::int64_t stamp_ns = 0);

/// Throws Error(data) unless the grid has cells and all its layers are of one size.
void require_cells(const HeightGrid& grid, const std::filesystem::path& file);

}  // namespace octosurf::io
