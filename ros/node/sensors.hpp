#pragma once

#include "io/readers/reading_rules.hpp"
#include "io/readers/sensor_messages.hpp"
#include "io/readers/transform_tree.hpp"
#include "node_options.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include <octosurf/ros_messages.hpp>

namespace octosurf::node {

/// Posed scans from messages, by the same rules and code as for a bag (scan_source.hpp), so that a live map
/// equals the one that `octosurf map` makes of the recording. Messages may be added from any thread. An
/// invalid message throws std::runtime_error, and nothing of it is kept.
class Sensors {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Sensors(const NodeOptions& options) : options_(options) {}

  /// Returns a warning if time was set back.
  std::string add_transforms(std::string_view message, bool fixed);
  void add_camera(std::string_view message);
  /// No more messages: scans are posed with the available data.
  void end();

  /// The scan of a PointCloud2 or an Image, posed. Waits until `latest` for data that fix its pose: a
  /// transform at or after its time for everything that moves between sensor and map, and the camera. Then
  /// uses the available data, as for the last scans of a bag. `sent_ns`: its time if its header has none.
  ReceivedScan scan_of(std::string_view message, std::int64_t sent_ns, Clock::time_point latest,
                       const std::stop_token& stop);

  /// T_map_base at the newest time at which it is known, and that time, ns. Throws io::NoPose.
  std::pair<Eigen::Isometry3d, std::int64_t> base_pose();

 private:
  bool ready(const io::MessageHeader& header);
  Eigen::Isometry3d pose(const io::MessageHeader& header, const std::string& frame);
  void sort_tree();

  const NodeOptions& options_;
  std::mutex mutex_;
  std::condition_variable_any news_;
  io::TransformTree tree_;
  bool tree_sorted_ = true, ended_ = false;
  std::map<std::string, std::int64_t> newest_ns_;  // of each moving frame
  std::optional<std::string> camera_;  // CameraInfo as it came, found to be one of a calibrated camera
};

}  // namespace octosurf::node
