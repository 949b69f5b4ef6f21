#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <functional>
#include <ros/duration.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <string>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

namespace octosurf::ros1 {

/// Poses out of tf, which a thread of its own listens to.
class PoseLookup {
 public:
  /// `refuse` is told of messages with a transform that tf does not take.
  PoseLookup(ros::NodeHandle& node, ros::Duration history, std::function<void(const std::string&)> refuse);

  /// T_fixed_sensor at that time. Waits for it, `timeout_s` at most, by the wall's clock, as a simulated one
  /// may stand still. Throws Error(data) that names `where` if it does not come or is no rigid motion.
  ///
  /// The frames' own transforms are put together here, as open_scans() does for a bag: where tf has them at
  /// the scan's very time, the pose is the same to the bit.
  Eigen::Isometry3d at(const std::string& fixed, const std::string& sensor, std::int64_t stamp_ns,
                       double timeout_s, const std::string& where, const std::atomic<bool>& stopping);

  /// Messages that came, but for those refused.
  std::uint64_t messages() const { return messages_; }
  std::uint32_t publishers() const { return tf_.getNumPublishers() + tf_static_.getNumPublishers(); }

 private:
  /// Only counts; the listener takes them.
  void count(const char* topic, const tf2_msgs::TFMessage& message);

  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  const std::function<void(const std::string&)> refuse_;
  std::atomic<std::uint64_t> messages_ = 0;
  ros::Subscriber tf_, tf_static_;  // last: what they call is there
};

}  // namespace octosurf::ros1
