#pragma once

#include "pose_lookup.hpp"
#include "scan_queue.hpp"
#include "settings.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <string>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::ros1 {

struct PosedScan {
  Scan scan;
  ros::Time stamp;
};

/// Who is heard, and what came besides scans.
struct Heard {
  std::uint32_t scan_publishers = 0, camera_publishers = 0, transform_publishers = 0;
  std::uint64_t transforms = 0;        ///< messages of tf
  std::uint64_t messages_refused = 0;  ///< of tf and CameraInfo
  std::string last_refusal;            ///< of these
};

/// Subscribes to clouds, depth images and their cameras, and makes scans of them.
class ScanIntake {
 public:
  ScanIntake(ros::NodeHandle& node, const Settings& settings, std::function<Options()> options);

  /// The next scan with its pose; waits for both. Nothing once stop() was called. Throws Error(data) for a
  /// message that is refused, and goes on with the next one when it is called again.
  std::optional<PosedScan> next();
  void stop();
  ScanQueue::Counts counts() const { return queue_.counts(); }
  Heard heard() const;

 private:
  using Bytes = std::shared_ptr<const std::string>;
  template <class Message>
  static ros::Subscriber subscribe(ros::NodeHandle& node, const std::string& topic,
                                   std::function<void(Bytes)> take);
  void take_camera(const std::string& images, Bytes bytes);
  void refuse(const std::string& why);
  void take(const std::string& topic, bool is_depth, Bytes bytes);
  Bytes camera_of(const std::string& topic, const std::string& where) const;

  const std::string fixed_frame_;
  const std::function<Options()> options_;
  ScanQueue queue_;
  std::atomic<bool> stopping_ = false;
  mutable std::mutex mutex_;
  std::map<std::string, Bytes> cameras_;  // CameraInfo by the images' topic
  std::uint64_t messages_refused_ = 0;    // of tf and CameraInfo
  std::string last_refusal_;              // of these
  PoseLookup poses_;
  std::vector<ros::Subscriber> scan_topics_, camera_topics_;  // last: what they call is there
};

}  // namespace octosurf::ros1
