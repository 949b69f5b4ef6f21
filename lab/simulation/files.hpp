#pragma once

#include "simulation/recording.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace octosurf::simulation {

// Writers of a recording's files; each throws Error(output) naming the file.

/// 16-bit grey PNG, row by row.
void write_png(const std::filesystem::path& file, std::span<const std::uint16_t> pixels, std::size_t width);

/// Binary PCD with fields x y z label; VIEWPOINT is scan.T_map_sensor.
void write_pcd(const std::filesystem::path& file, const LabelledScan& scan);

void write_text(const std::filesystem::path& file, const std::string& text);

/// `tx ty tz qx qy qz qw` and 4×4 rows, with 17 significant digits.
std::string tum_pose(const Eigen::Isometry3d& T);
std::string matrix_pose(const Eigen::Isometry3d& T);

/// Makes an empty or existing folder ready. Throws Error(usage) if it holds anything and `force` is
/// off; with it, files that a recording consists of are removed, all others stay.
void prepare_folder(const std::filesystem::path& dir, bool force);

}  // namespace octosurf::simulation
