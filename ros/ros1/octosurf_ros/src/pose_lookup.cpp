#include "pose_lookup.hpp"

#include <chrono>
#include <geometry_msgs/TransformStamped.h>
#include <thread>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::ros1 {

PoseLookup::PoseLookup(ros::Duration history) : buffer_(history), listener_(buffer_, true) {}

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
    T_frame_sensor =
        pose_from_transform({step.translation.x, step.translation.y, step.translation.z},
                            {step.rotation.w, step.rotation.x, step.rotation.y, step.rotation.z}, where) *
        T_frame_sensor;
  }
  return T_frame_sensor;
}

}  // namespace octosurf::ros1
