#include "io/readers/bag_index.hpp"

#include "io/readers/bounded_file.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Memory per scan until it is read: its place, here and in the list of scans to map.
constexpr std::uint64_t bytes_of_scan = 512;
// Memory per two new frames, without their names.
constexpr std::uint64_t bytes_of_frame = 1024;

void count(const BagMessage& message, TopicContents& contents) {
  const std::int64_t now = message.logged_ns;
  contents.first_ns = contents.messages == 0 ? now : std::min(contents.first_ns, now);
  contents.last_ns = contents.messages == 0 ? now : std::max(contents.last_ns, now);
  ++contents.messages;
  contents.bytes += message.bytes.size();
}

/// Adds the data of one message.
class Indexer {
 public:
  Indexer(std::string name, std::uint64_t bytes, std::vector<std::string>* left_out)
      : name_(std::move(name)), budget_(largest_index(bytes)), left_out_(left_out) {}

  void add(const BagTopic& topic, const BagMessage& message) {
    while (index_.topics.size() <= message.topic) index_.topics.emplace_back();
    TopicContents& contents = index_.topics[message.topic];
    if (contents.messages == 0) contents.topic = topic;
    count(message, contents);
    if (topic.encoding == MessageEncoding::other) return;
    if (is_cloud_type(topic.type) || topic.type == "sensor_msgs/Image" ||
        topic.type == "sensor_msgs/CompressedImage")
      return add_scan(contents, message);
    try {
      add_pose_or_camera(contents, message);
    } catch (const Error&) {
      throw;
    } catch (const std::runtime_error& error) {
      const Error bad(Error::Kind::data, name_ + " " + topic.name,
                      "message " + std::to_string(contents.messages) + " " + error.what(),
                      "record it again; --skip-bad skips it");
      if (!left_out_) throw bad;
      keep(sizeof(std::string) + std::string(bad.what()).size());
      left_out_->emplace_back(bad.what());
    }
  }

  BagIndex finish() {
    index_.tree.finish();
    for (TopicContents& contents : index_.topics) contents.poses.finish();
    return std::move(index_);
  }

 private:
  /// A damaged one is listed, too, as a bad scan.
  void add_scan(TopicContents& contents, const BagMessage& message) {
    MessageHeader header;
    try {
      const BagTopic& topic = contents.topic;
      if (is_cloud_type(topic.type) &&
          points_in(*message_reader(message.bytes, topic.encoding), topic.type) == 0) {
        ++contents.empty_scans;  // such messages often have no frame and no time either
        return;
      }
      header = read_header(*message_reader(message.bytes, topic.encoding));
    } catch (const std::runtime_error&) {
      header = {};
    }
    if (!contents.is_depth) contents.is_depth = is_depth(contents.topic, message.bytes);
    keep(bytes_of_scan);
    contents.scans.push_back({message.place, header.stamp_ns != 0 ? header.stamp_ns : message.logged_ns,
                              static_cast<std::uint32_t>(message.topic), frame_index(header.frame)});
  }

  static bool is_depth(const BagTopic& topic, std::string_view bytes) {
    if (is_cloud_type(topic.type)) return true;
    try {
      const auto reader = message_reader(bytes, topic.encoding);
      if (topic.type == "sensor_msgs/CompressedImage")
        return read_compressed_image_message(*reader).is_depth();
      return depth_kind(read_image_message(*reader).encoding) != DepthKind::none;
    } catch (const std::runtime_error&) {
      return false;
    }
  }

  void add_pose_or_camera(TopicContents& contents, const BagMessage& message) {
    const std::string& type = contents.topic.type;
    const auto reader = message_reader(message.bytes, contents.topic.encoding);
    if (type == "tf2_msgs/TFMessage" || type == "tf/tfMessage") {
      const bool fixed = contents.topic.name.ends_with("tf_static");
      for_each_transform(*reader,
                         [&](const TransformMessage& transform) { add_transform(transform, fixed); });
    } else if (is_pose_type(type)) {
      const TransformMessage pose = read_pose_message(*reader, type);
      if (contents.poses.samples().empty()) {
        contents.pose_parent = pose.header.frame;
        contents.pose_child = pose.child_frame;
      }
      keep(sizeof(PoseTrack::Sample));
      contents.poses.add(sample_of(pose));
    } else if (type == "sensor_msgs/CameraInfo") {
      const CameraInfoMessage camera = read_camera_info(*reader);
      if (!contents.camera) contents.camera = camera;
      contents.camera_changes |= *contents.camera != camera;
    }
  }

  void add_transform(const TransformMessage& transform, bool fixed) {
    const std::size_t frames = index_.tree.size();
    index_.tree.add({transform.header.frame, transform.child_frame, fixed}, sample_of(transform));
    keep(sizeof(PoseTrack::Sample));
    if (index_.tree.size() > frames)
      keep(bytes_of_frame + 4 * (transform.header.frame.size() + transform.child_frame.size()));
  }

  static PoseTrack::Sample sample_of(const TransformMessage& transform) {
    return {transform.header.stamp_ns, 0, transform.translation,
            Eigen::Quaternion<double, Eigen::DontAlign>(transform.rotation)};
  }

  std::uint32_t frame_index(const std::string& frame) {
    const auto [found, is_new] =
        frame_indices_.emplace(frame, static_cast<std::uint32_t>(index_.frames.size()));
    if (is_new) {
      keep(4 * frame.size() + 128);  // as a key and as a name
      index_.frames.push_back(frame);
    }
    return found->second;
  }

  void keep(std::uint64_t bytes) {
    kept_ += bytes;
    if (kept_ > budget_)
      throw Error(Error::Kind::data, name_, "holds far more transforms and scans than its size allows",
                  "record it with less compression, or in parts");
  }

  std::string name_;
  std::uint64_t budget_ = 0, kept_ = 0;
  std::vector<std::string>* left_out_;
  BagIndex index_;
  std::map<std::string, std::uint32_t> frame_indices_;
};

}  // namespace

BagIndex index_bag(Bag& bag, const std::string& name, std::uint64_t bytes,
                   std::vector<std::string>* left_out) {
  Indexer indexer(name, bytes, left_out);
  bag.read_all([&](const BagMessage& message) { indexer.add(bag.topics()[message.topic], message); },
               left_out);
  return indexer.finish();
}

std::vector<TopicContents> summarise_bag(Bag& bag, std::vector<std::string>& damage) {
  std::vector<TopicContents> topics;
  bag.read_all(
      [&](const BagMessage& message) {
        while (topics.size() <= message.topic) topics.emplace_back();
        count(message, topics[message.topic]);
      },
      &damage);
  topics.resize(bag.topics().size());
  for (std::size_t i = 0; i < topics.size(); ++i) topics[i].topic = bag.topics()[i];
  return topics;
}

}  // namespace octosurf::io
