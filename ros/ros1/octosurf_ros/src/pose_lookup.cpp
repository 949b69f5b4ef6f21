#include "pose_lookup.hpp"

#include <chrono>
#include <geometry_msgs/TransformStamped.h>
#include <ros/console.h>
#include <thread>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::ros1 {

namespace {

Eigen::Isometry3d pose_of(const geometry_msgs::Transform& transform, const std::string& where) {
  const geometry_msgs::Vector3& t = transform.translation;
  const geometry_msgs::Quaternion& q = transform.rotation;
  return pose_from_transform({t.x, t.y, t.z}, {q.w, q.x, q.y, q.z}, where);
}

}  // namespace

PoseLookup::PoseLookup(ros::NodeHandle& node, ros::Duration history,
                       std::function<void(const std::string&)> refuse)
    : buffer_(history), listener_(buffer_, true), refuse_(std::move(refuse)) {
  const auto subscribe = [&](const char* topic) {
    const boost::function<void(const tf2_msgs::TFMessageConstPtr&)> callback =
        [this, topic](const tf2_msgs::TFMessageConstPtr& message) { count(topic, *message); };
    return node.subscribe<tf2_msgs::TFMessage>(topic, 0, callback);
  };
  tf_ = subscribe("/tf");
  tf_static_ = subscribe("/tf_static");
}

void PoseLookup::count(const char* topic, const tf2_msgs::TFMessage& message) {
  try {
    for (const geometry_msgs::TransformStamped& transform : message.transforms) {
      const std::string& child = transform.child_frame_id;
      const std::string where = std::string(topic) + ": transform of " + child;
      if (child.empty() || child == transform.header.frame_id)
        throw Error(Error::Kind::data, where, "it is one of a frame in itself, or of none");
      pose_of(transform.transform, where);
    }
    ++messages_;
  } catch (const Error& error) {
    refuse_(error.what());
    ROS_WARN_STREAM_THROTTLE(1, "refused: " << error.what());
  }
}

Eigen::Isometry3d PoseLookup::at(const std::string& fixed, const std::string& sensor, std::int64_t stamp_ns,
                                 double timeout_s, const std::string& where,
                                 const std::atomic<bool>& stopping) {
  using Clock = std::chrono::steady_clock;
  const ros::Time stamp = ros::Time().fromNSec(static_cast<std::uint64_t>(stamp_ns));
  const auto end = Clock::now() + std::chrono::duration<double>(timeout_s);
  std::string why;
  while (!buffer_.canTransform(fixed, sensor, stamp, &why)) {
    if (stopping || Clock::now() >= end)
      throw Error(Error::Kind::data, where, "no pose of " + sensor + " in " + fixed + ": " + why,
                  "~pose_timeout waits longer");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::vector<std::string> frames;
  buffer_._chainAsVector(fixed, stamp, sensor, stamp, fixed, frames);
  // From the sensor up, as bags have it: the rounding of a product depends on its order.
  Eigen::Isometry3d T_frame_sensor = Eigen::Isometry3d::Identity();
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const geometry_msgs::Transform step = buffer_.lookupTransform(frames[i], frames[i - 1], stamp).transform;
    T_frame_sensor = pose_of(step, where) * T_frame_sensor;
  }
  return T_frame_sensor;
}

}  // namespace octosurf::ros1
