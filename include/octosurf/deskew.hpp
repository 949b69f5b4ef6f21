#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <span>

#include <octosurf/scan.hpp>

namespace octosurf {

/// T_map_sensor at a time, s, on the clock of Scan::stamp_s.
using PoseAtTime = std::function<Eigen::Isometry3d(double stamp_s)>;

/// Where a sensor was at a time.
struct StampedPose {
  double stamp_s = 0;                                              ///< on the clock of Scan::stamp_s
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();  ///< rigid
};

/// Undoes a sensor's motion within a scan by its readings' times: a robot moves while its lidar turns.
///
///     Scan scan = …;                                      // points as the sensor saw them, times_s
///     mapper.insert(deskew(std::move(scan), trajectory));
///
/// 1. Points move to where they were in the sensor's frame at `stamp_s`, whose pose stays `T_map_sensor`.
/// 2. `origins` holds where the sensor was at each reading's time, and `times_s` is empty.
/// 3. A reading whose time is not finite becomes no reading (NaN).
/// 4. A scan without `times_s` comes back as it is.
///
/// `pose_at` is called once a millisecond of the scan, and poses between are interpolated. What it throws is
/// passed on. Throws Error(data) if there is not one time for each reading, or they span over an hour.
/// O(points).
Scan deskew(Scan scan, const PoseAtTime& pose_at);

/// The same by interpolation between poses in ascending order of time. Before the first and after the last
/// the motion of the nearest two continues, for as long as the time between them. Throws Error(data) for
/// fewer than two poses, for times that do not ascend, and for a scan outside that time.
Scan deskew(Scan scan, std::span<const StampedPose> poses);

}  // namespace octosurf
