#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

namespace octosurf {

/// What took a scan.
enum class SensorKind { depth_camera, lidar };

/// What a scan's readings told of the sensor's noise, for a thinned scan that no longer can: so many
/// differences of one size, at distances of one class. Only octosurf makes them, when it keeps a scan.
struct NoiseCount {
  std::uint8_t range_class = 0;  ///< of distances, src/sensing/noise_model.hpp
  std::uint8_t size = 0;         ///< class of differences, likewise
  std::uint32_t count = 0;       ///< of differences in both
};

/// What of the errors of a scan's readings is not noise, as they told where they lay beside the map's
/// surfaces; for a thinned scan, too.
struct SharedVariance {
  std::uint8_t range_class = 0;  ///< of distances; 0: of the readings of one surface, along its normal
  double variance = 0;           ///< m², estimated, so that it may come out below 0
};

/// One posed scan. Points are in the sensor's frame, in metres, in any order; points that are not
/// finite are "no reading" and are skipped (and counted) by the mapper.
struct Scan {
  std::vector<Eigen::Vector3f> points;  ///< readings, sensor frame, m
  /// Sensor frame to map frame; must be a rigid motion.
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  double stamp_s = 0;                            ///< time the scan was taken, seconds
  SensorKind sensor = SensorKind::depth_camera;  ///< picks the default maximum range
  std::string name;                              ///< for messages: file or index
  /// How many readings each point is the mean of, where the scan was thinned before, as an archive's is:
  /// empty, or a number from 1 on for each point. Such points do not tell the sensor's errors, the
  /// next two do.
  std::vector<std::uint16_t> readings{};
  std::vector<NoiseCount> noise{};                 ///< of such a thinned scan; else empty
  std::vector<SharedVariance> shared_variances{};  ///< likewise, each class once
};

/// Throws Error(data) unless `readings` is as it says there, and their sum below 2³².
void require_readings(const Scan& scan);

/// Throws Error(data) naming `where` unless T is finite and |RᵀR − I| ≤ 1e-3, det R > 0.
void require_rigid(const Eigen::Isometry3d& T, const std::string& where);

}  // namespace octosurf
