#include "scan_intake.hpp"

#include "raw_message.hpp"

#include <chrono>
#include <ros/console.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <thread>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::ros1 {

template <class Message>
ros::Subscriber ScanIntake::subscribe(ros::NodeHandle& node, const std::string& topic,
                                      std::function<void(Bytes)> take) {
  // Never waits for long: what has to wait does so in queue_, which counts.
  const boost::function<void(const boost::shared_ptr<const Raw<Message>>&)> callback =
      [take = std::move(take)](const boost::shared_ptr<const Raw<Message>>& message) {
        // Boost's pointer lives as long as what the standard's deletes: nothing is copied.
        take(Bytes(std::shared_ptr<const void>(nullptr, [message](const void*) {}), &message->bytes));
      };
  return node.subscribe<Raw<Message>>(topic, 0, callback);
}

ScanIntake::ScanIntake(ros::NodeHandle& node, const Settings& settings, std::function<Options()> options)
    : fixed_frame_(settings.fixed_frame),
      options_(std::move(options)),
      poses_(node, ros::Duration(settings.tf_history_s), [this](const std::string& why) { refuse(why); }) {
  for (const std::string& topic : settings.cloud_topics)
    scan_topics_.push_back(subscribe<sensor_msgs::PointCloud2>(
        node, topic, [this, topic](Bytes bytes) { take(topic, false, std::move(bytes)); }));
  for (const std::string& topic : settings.depth_topics) {
    camera_topics_.push_back(subscribe<sensor_msgs::CameraInfo>(
        node, camera_info_topic(topic),
        [this, topic](Bytes bytes) { take_camera(topic, std::move(bytes)); }));
    scan_topics_.push_back(subscribe<sensor_msgs::Image>(
        node, topic, [this, topic](Bytes bytes) { take(topic, true, std::move(bytes)); }));
  }
}

void ScanIntake::refuse(const std::string& why) {
  const std::lock_guard lock(mutex_);
  ++messages_refused_;
  last_refusal_ = why;
}

void ScanIntake::take_camera(const std::string& images, Bytes bytes) {
  try {
    require_camera(*bytes, MessageEncoding::ros1, camera_info_topic(images), is_rectified(images));
  } catch (const Error& error) {
    refuse(error.what());
    ROS_WARN_STREAM_THROTTLE(1, "refused: " << error.what());
    return;
  }
  const std::lock_guard lock(mutex_);
  cameras_[images] = std::move(bytes);
}

Heard ScanIntake::heard() const {
  const auto publishers = [](const std::vector<ros::Subscriber>& topics) {
    std::uint32_t sum = 0;
    for (const ros::Subscriber& topic : topics) sum += topic.getNumPublishers();
    return sum;
  };
  Heard heard;
  heard.scan_publishers = publishers(scan_topics_);
  heard.camera_publishers = publishers(camera_topics_);
  heard.transform_publishers = poses_.publishers();
  heard.transforms = poses_.messages();
  const std::lock_guard lock(mutex_);
  heard.messages_refused = messages_refused_;
  heard.last_refusal = last_refusal_;
  return heard;
}

void ScanIntake::take(const std::string& topic, bool is_depth, Bytes bytes) {
  const std::size_t dropped =
      queue_.push({topic, is_depth, std::move(bytes)}, static_cast<std::size_t>(options_().queue_size));
  if (dropped > 0)
    ROS_WARN_STREAM_THROTTLE(
        10, "scans come faster than they are mapped: " << queue_.counts().dropped << " dropped so far");
}

ScanIntake::Bytes ScanIntake::camera_of(const std::string& topic, const std::string& where) const {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(options_().pose_timeout);
  while (true) {
    {
      const std::lock_guard lock(mutex_);
      if (const auto camera = cameras_.find(topic); camera != cameras_.end()) return camera->second;
    }
    if (stopping_ || Clock::now() >= end)
      throw Error(Error::Kind::data, where, "no camera: nothing came on " + camera_info_topic(topic));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

std::optional<PosedScan> ScanIntake::next() {
  const std::optional<WaitingScan> waiting = queue_.pop();
  if (!waiting) return {};
  const std::string& where = waiting->topic;
  ReceivedScan received = waiting->is_depth
                              ? scan_from_depth(*waiting->bytes, *camera_of(where, where),
                                                MessageEncoding::ros1, where, is_rectified(where))
                              : scan_from_cloud(*waiting->bytes, MessageEncoding::ros1, where);
  received.scan.name += " at " + std::to_string(received.scan.stamp_s);
  received.scan.T_map_sensor = poses_.at(fixed_frame_, received.frame, received.stamp_ns,
                                         options_().pose_timeout, received.scan.name, stopping_);
  return PosedScan{std::move(received.scan),
                   ros::Time().fromNSec(static_cast<std::uint64_t>(received.stamp_ns))};
}

void ScanIntake::stop() {
  stopping_ = true;
  queue_.close();
}

}  // namespace octosurf::ros1
