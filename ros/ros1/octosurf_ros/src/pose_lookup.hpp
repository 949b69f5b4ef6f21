#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <ros/duration.h>
#include <string>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

namespace octosurf::ros1 {

/// Poses out of tf, which a thread of its own listens to.
class PoseLookup {
 public:
  explicit PoseLookup(ros::Duration history);

  /// T_fixed_sensor at that time. Waits for it, `timeout_s` at most, by the wall's clock, as a simulated one
  /// may stand still. Throws Error(data) that names `where` if it does not come or is no rigid motion.
  ///
  /// The frames' own transforms are put together here, as open_scans() does for a bag: where tf has them at
  /// the scan's very time, the pose is the same to the bit.
  Eigen::Isometry3d at(const std::string& fixed, const std::string& sensor, std::int64_t stamp_ns,
                       double timeout_s, const std::string& where, const std::atomic<bool>& stopping);

 private:
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
};

}  // namespace octosurf::ros1
