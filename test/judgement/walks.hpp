// Recordings of walks through the furnished room, and changes of them.
#pragma once

#include "support/testing.hpp"

#include <octosurf/scan.hpp>

namespace octosurf::test {

using Scans = std::vector<Scan>;
inline constexpr int scans_of_walk = 48;

/// An eight through the room, ten scans a second.
Eigen::Isometry3d place(int i);
/// Named "scan 0" …, and stamped.
Scans numbered(Scans scans);
/// By a camera that looks ahead and down to all sides.
Scans camera_walk(std::mt19937_64& rng);
/// One sweep of a laser, turned about its x axis.
Scan line(const Eigen::Isometry3d& T_map_sensor, double tilt_rad, std::mt19937_64& rng);
/// By a lidar of 32 rings that turns and rolls on its way.
Scans lidar_walk(std::mt19937_64& rng);

using Change = std::function<void(Scans&)>;
Change each(const std::function<void(Scan&)>& change);
/// Readings, by axis.
Change scaled(const Eigen::Vector3f& factors);
/// Poses, to the right.
Change mounted(const Eigen::Isometry3d& T);
/// Poses are those of so many scans before.
Change late(std::size_t by);

}  // namespace octosurf::test
