#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf {

/// Type of sensor.
enum class SensorKind { depth_camera, lidar };

/// Of clouds in a frame of that name: REP 103 calls cameras' frames so, and only theirs.
inline SensorKind sensor_of_frame(std::string_view frame) {
  return frame.ends_with("_optical_frame") ? SensorKind::depth_camera : SensorKind::lidar;
}

/// One posed scan. Points are in the sensor's frame, in metres, in any order; points that are not
/// finite are "no reading" and are skipped (and counted) by the mapper.
struct Scan {
  std::vector<Eigen::Vector3f> points;  ///< readings, sensor frame, m
  /// Sensor frame to map frame; must be a rigid motion.
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  double stamp_s = 0;                            ///< time the scan was taken, seconds
  SensorKind sensor = SensorKind::depth_camera;  ///< picks the default maximum range
  std::string name;                              ///< for messages: file or index
  /// When each reading was taken, s after `stamp_s`; empty: all at once. deskew() undoes the motion
  /// meanwhile.
  std::vector<float> times_s{};
  /// Where each reading's ray starts, sensor frame at `stamp_s`, m; empty: at 0. Neighbours with equal ones
  /// are traced together.
  std::vector<Eigen::Vector3f> origins{};
  /// Ends of further rays from the sensor, which met nothing up to there: sensor frame at `stamp_s`, m. They
  /// free space, up to the maximum range.
  std::vector<Eigen::Vector3f> free_rays{};
};

/// Throws Error(data) naming `where` unless T is finite and |RᵀR − I| ≤ 1e-3, det R > 0.
void require_rigid(const Eigen::Isometry3d& T, const std::string& where);

}  // namespace octosurf
