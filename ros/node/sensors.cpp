#include "sensors.hpp"

#include "io/readers/pose_file.hpp"
#include "io/readers/reading_rules.hpp"

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::node {
namespace {

// Longer than scans wait: 256 MB of depth images are 14 s at 30 Hz, of a lidar's clouds half a minute.
constexpr std::int64_t transforms_kept_ns = 60'000'000'000;
// A robot has some hundred. A flood of unknown names must not fill the memory.
constexpr std::size_t most_frames = 10000;
// Of one frame: earlier by more than this is no reordering (reliable writers resend lost messages within Fast
// DDS's 3 s) but a simulator's reset or a recording's restart.
constexpr std::int64_t out_of_order_ns = 3'000'000'000;

std::unique_ptr<io::MessageReader> reader_of(std::string_view message) {
  return io::message_reader(message, MessageEncoding::cdr);
}

}  // namespace

std::string Sensors::add_transforms(std::string_view message, bool fixed) {
  std::string warning;
  std::vector<io::TransformMessage> transforms;
  io::for_each_transform(*reader_of(message), [&](const io::TransformMessage& transform) {
    io::rigid(io::pose_from(transform.translation, transform.rotation),
              "transform of " + transform.child_frame);
    if (transform.child_frame.empty() || transform.child_frame == transform.header.frame)
      throw std::runtime_error("a transform of frame '" + transform.child_frame + "' in itself");
    transforms.push_back(transform);
  });
  {
    const std::lock_guard lock(mutex_);
    for (const io::TransformMessage& transform : transforms) {
      const std::int64_t stamp = transform.header.stamp_ns;
      if (const auto last = newest_ns_.find(transform.child_frame);
          !fixed && last != newest_ns_.end() && stamp < last->second - out_of_order_ns) {
        warning = "time was set back by " + std::to_string((last->second - stamp) / 1'000'000'000) +
                  " s at frame " + transform.child_frame + ": earlier transforms are forgotten";
        tree_.forget_moving();
        newest_ns_.clear();
      }
      const bool known = tree_.knows(transform.child_frame) && tree_.knows(transform.header.frame);
      if (!known && tree_.size() + 2 > most_frames)
        throw std::runtime_error("more than " + std::to_string(most_frames) + " frames");
      tree_.add({transform.header.frame, transform.child_frame, fixed},
                {stamp, transform.translation, transform.rotation});
      if (!fixed) newest_ns_[transform.child_frame] = std::max(newest_ns_[transform.child_frame], stamp);
    }
    tree_sorted_ = false;
  }
  news_.notify_all();
  return warning;
}

void Sensors::end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  news_.notify_all();
}

void Sensors::add_camera(std::string_view message) {
  require_camera(message, MessageEncoding::cdr, {}, is_rectified(options_.depth));
  {
    const std::lock_guard lock(mutex_);
    camera_ = message;
  }
  news_.notify_all();
}

void Sensors::sort_tree() {
  if (std::exchange(tree_sorted_, true)) return;
  tree_.finish();
  tree_.keep_last(transforms_kept_ns);
}

bool Sensors::ready(const io::MessageHeader& header) {
  sort_tree();
  for (const SelfBox& self : options_.readings.self_boxes)
    if (self.frame && !tree_.settled(*self.frame, header.frame, header.stamp_ns)) return false;
  return (!options_.takes_depth() || camera_) && tree_.settled(options_.frame, header.frame, header.stamp_ns);
}

Eigen::Isometry3d Sensors::pose(const io::MessageHeader& header, const std::string& frame) {
  sort_tree();
  return tree_.lookup(frame, header.frame, header.stamp_ns, io::largest_gap_in_bags_ns);
}

std::pair<Eigen::Isometry3d, std::int64_t> Sensors::base_pose() {
  const std::lock_guard lock(mutex_);
  sort_tree();
  const auto stamp = tree_.newest(options_.frame, options_.base);
  if (!stamp) throw io::NoPose("tf does not connect " + options_.base + " with " + options_.frame);
  return {tree_.lookup(options_.frame, options_.base, *stamp, 0), *stamp};
}

ReceivedScan Sensors::scan_of(std::string_view message, std::int64_t sent_ns, Clock::time_point latest,
                              const std::stop_token& stop) {
  io::MessageHeader header = io::read_header(*reader_of(message));
  if (header.stamp_ns == 0) header.stamp_ns = sent_ns;
  Eigen::Isometry3d T_map_sensor;
  std::optional<std::string> camera;
  {
    std::unique_lock lock(mutex_);
    // A scan whose pose may still change must not be the last one of a map that is ended.
    if (!news_.wait_until(lock, stop, latest, [&] { return ended_ || ready(header); }) &&
        stop.stop_requested())
      throw std::runtime_error("the node was ended while it waited for its pose");
    T_map_sensor = pose(header, options_.frame);
    camera = camera_;
  }
  constexpr MessageEncoding cdr = MessageEncoding::cdr;
  ReceivedScan received;
  if (!options_.takes_depth()) {
    received = scan_from_cloud(message, cdr, {}, options_.readings.sensor);
  } else {
    if (!camera) throw std::runtime_error("no CameraInfo has come yet");
    const bool rectified = is_rectified(options_.depth);
    received = scan_from_depth(message, *camera, cdr, {}, rectified, options_.depth_scale);
  }
  {
    const std::lock_guard lock(mutex_);
    io::erase_own(received.scan, options_.readings.self_boxes,
                  [&](const std::string& frame) { return pose(header, frame); });
    io::drop_no_returns(received.scan, options_.takes_depth(), options_.readings);
  }
  received.stamp_ns = header.stamp_ns;
  received.scan.name = options_.scans() + " at " + io::stamp_text(header.stamp_ns);
  received.scan.stamp_s = static_cast<double>(header.stamp_ns) / 1e9;
  received.scan.T_map_sensor = T_map_sensor;
  return received;
}

}  // namespace octosurf::node
