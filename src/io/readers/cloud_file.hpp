#pragma once

#include "io/readers/scan_motion.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

namespace octosurf::io {

/// Labels of a PCD's points.
struct PcdLabels {
  std::string field;           ///< label, else intensity, four bytes wide; empty: none
  std::vector<double> values;  ///< of the points
  bool colored = false;        ///< it has a field rgba, too
};

/// A point cloud file's points (sensor frame, metres, unconverted) and pose, unchecked. Points exactly at the
/// origin become not finite: drivers write them for "no return".
struct Cloud {
  std::vector<Eigen::Vector3f> points;
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  /// m, subtracted from the points: 0 unless half of them lie farther than `farthest_m` (cloud_rows.hpp) from
  /// 0 along an axis, as a survey's coordinates do, which float would round; then whole metres amid them.
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  PointTimes times{};  ///< of a field that is called like a time
  PcdLabels labels{};
};

// Each throws Error(data) for files that are truncated, damaged or without points. Headers are checked
// against the size of the file before any allocation, as PCL's readers do not.

/// PCD of version 0.7: DATA ascii, binary or binary_compressed; x, y, z float or double; its pose is
/// VIEWPOINT.
Cloud read_pcd(const std::filesystem::path& file);
/// Several points in one column, as a camera's scans are kept (kept_scans.hpp).
bool is_column(const std::filesystem::path& pcd);
/// PLY: ascii or binary of either byte order; the vertices' x, y, z, float or double; no pose.
Cloud read_ply(const std::filesystem::path& file);
/// KITTI's velodyne: float32 x y z reflectance, little-endian; no pose.
Cloud read_velodyne(const std::filesystem::path& file);

constexpr std::size_t largest_cloud_file = std::size_t{4} << 30;

}  // namespace octosurf::io
