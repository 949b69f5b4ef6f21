#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/sensor_messages.hpp"
#include "io/readers/transform_tree.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace octosurf::io {

/// A cloud or an image in a bag, found but not read.
struct ListedMessage {
  MessagePlace place;
  std::int64_t stamp_ns = 0;   ///< of its header, or else the recording time
  std::int64_t header_ns = 0;  ///< as it was, for names and its points' times
  std::uint32_t topic = 0;
  std::uint32_t frame = 0;  ///< index into BagIndex::frames
};

struct ListedCamera {
  std::int64_t stamp_ns = 0;
  CameraInfoMessage camera;
};

/// Contents of a topic found in one pass; only the fields of its type are set.
struct TopicContents {
  BagTopic topic;
  std::uint64_t messages = 0, bytes = 0;
  std::int64_t first_ns = 0, last_ns = 0;  ///< when they were recorded
  std::vector<ListedMessage> scans;        ///< clouds and images with points
  std::uint64_t empty_scans = 0;           ///< those without
  double apart_s = 0;                      ///< least time from scans to the poses recorded with them
  bool is_depth = false;                   ///< clouds, and images one of which is of depth
  std::string encoding;                    ///< of the first image
  double unit_m = 0;                       ///< a std_msgs/Float32, as librealsense's Depth_Units
  Trajectory poses;                        ///< of messages that hold one pose
  std::string pose_parent, pose_child;     ///< frames of the first one; a child is optional
  std::vector<ListedCamera> cameras;       ///< by time, where they change; calibrated ones, if any is
};

struct BagIndex {
  std::vector<TopicContents> topics;
  std::vector<std::string> frames;
  std::map<std::string, TransformTree> trees;  ///< by namespace: "" has /tf and /tf_static, "/a" /a/tf
  std::string set_back;                        ///< "… its clock is set back by 1.6 s"; empty: no pose's is
};

/// "/a" of "/a/tf".
std::string namespace_of(const std::string& topic);

/// Reads the bag once and sorts its messages by recording time. `recorded`: all stamps are the recorder's
/// time. Throws Error(data) for damage, also in messages of poses, transforms or cameras, and if their total
/// would exceed the limit for a bag of `bytes`; with `left_out`, damaged ones are skipped with a line each.
BagIndex index_bag(Bag& bag, const std::string& name, std::uint64_t bytes, bool recorded,
                   std::vector<std::string>* left_out);

/// Topics, counts and times of a bag of any messages; `damage` gets a line for each damaged part.
std::vector<TopicContents> summarise_bag(Bag& bag, std::vector<std::string>& damage);

}  // namespace octosurf::io
