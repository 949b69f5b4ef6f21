#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/sensor_messages.hpp"
#include "io/readers/transform_tree.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::io {

/// A cloud or an image in a bag, found but not read.
struct ListedMessage {
  MessagePlace place;
  std::int64_t stamp_ns = 0;  ///< of its header, or else the recording time
  std::uint32_t topic = 0;
  std::uint32_t frame = 0;  ///< index into BagIndex::frames
};

/// Contents of a topic found in one pass; only the fields of its type are set.
struct TopicContents {
  BagTopic topic;
  std::uint64_t messages = 0, bytes = 0;
  std::int64_t first_ns = 0, last_ns = 0;   ///< when they were recorded
  std::vector<ListedMessage> scans;         ///< of clouds and images, those of no point left out
  std::uint64_t empty_scans = 0;            ///< these
  bool is_depth = false;                    ///< clouds, and images one of which is of depth
  PoseTrack poses;                          ///< of messages that hold one pose
  std::string pose_parent, pose_child;      ///< frames of the first one; a child is optional
  std::optional<CameraInfoMessage> camera;  ///< the first
  bool camera_changes = false;
};

struct BagIndex {
  std::vector<TopicContents> topics;
  std::vector<std::string> frames;
  TransformTree tree;
};

/// Reads the bag once. Throws Error(data) for damage, also in messages of poses, transforms or cameras, and
/// if their total would exceed the limit for a bag of `bytes`; with `left_out`, damaged ones are skipped with
/// a line each.
BagIndex index_bag(Bag& bag, const std::string& name, std::uint64_t bytes,
                   std::vector<std::string>* left_out);

/// Topics, counts and times of a bag of any messages; `damage` gets a line for each damaged part.
std::vector<TopicContents> summarise_bag(Bag& bag, std::vector<std::string>& damage);

}  // namespace octosurf::io
