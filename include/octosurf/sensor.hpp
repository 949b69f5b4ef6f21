#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include <octosurf/scan.hpp>

namespace octosurf {

/// The kind of sensor, guessed from the directions of a cloud's readings.
struct SensorGuess {
  /// A depth camera's if the rays are a pinhole's raster, around z or x; else a lidar's.
  SensorKind kind = SensorKind::lidar;
  int axis = 2;  ///< a camera looks along it: 0 for x, 2 for z
  /// For messages: depth camera, spinning or solid-state lidar, or composed cloud, and why. Empty: too few
  /// readings to tell.
  std::string why;
};

/// Looks at the readings of one scan, in the sensor's frame. The result does not depend on their order, and
/// readings that are not finite or at the origin do not count. O(n log n) for a cloud within a cone, else
/// O(n).
SensorGuess guess_sensor(std::span<const Eigen::Vector3f> points);

}  // namespace octosurf
