#include "io/readers/bag_index.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Memory per scan until it is read: its place, here and in the list of scans to map.
constexpr std::uint64_t bytes_of_scan = 640;
// Memory per two new frames, without their names.
constexpr std::uint64_t bytes_of_frame = 1024;

void count(const BagMessage& message, TopicContents& contents) {
  const std::int64_t now = message.logged_ns;
  contents.first_ns = contents.messages == 0 ? now : std::min(contents.first_ns, now);
  contents.last_ns = contents.messages == 0 ? now : std::max(contents.last_ns, now);
  ++contents.messages;
  contents.bytes += message.bytes.size();
}

double distance(std::int64_t a, std::int64_t b) {
  return std::abs(static_cast<double>(a) - static_cast<double>(b));
}

/// Adds the data of one message.
class Indexer {
 public:
  Indexer(std::string name, std::uint64_t bytes, bool recorded, std::vector<std::string>* left_out)
      : name_(std::move(name)), budget_(largest_index(bytes)), recorded_(recorded), left_out_(left_out) {}

  void add(const BagTopic& topic, const BagMessage& message) {
    while (index_.topics.size() <= message.topic) index_.topics.emplace_back();
    TopicContents& contents = index_.topics[message.topic];
    if (contents.messages == 0) contents.topic = topic;
    count(message, contents);
    // The order within a file is that of recording, though the recorder's clock be set back.
    now_ns_ = std::exchange(file_, message.place.file) == message.place.file
                  ? std::max(now_ns_, message.logged_ns)
                  : message.logged_ns;
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
    if (!std::ranges::is_sorted(events_, {}, &Event::recorded_ns))  // of several files
      std::ranges::stable_sort(events_, {}, &Event::recorded_ns);
    give_stamps();
    compare_clocks();
    for (; !events_.empty(); events_.pop_front()) {
      const Event& event = events_.front();
      const Stream& stream = streams_[event.stream];
      TopicContents& contents = index_.topics[stream.topic];
      if (stream.tree != nullptr)
        stream.tree->add(stream.edge, event.sample);
      else if (stream.moves)
        contents.poses.add(event.sample);
      else if (contents.scans.empty())
        contents.cameras[event.index].stamp_ns = event.sample.stamp_ns;
      else
        contents.scans[event.index].stamp_ns = event.sample.stamp_ns;
    }
    for (const Stream& stream : streams_)
      if (std::isfinite(stream.apart_s)) index_.topics[stream.topic].apart_s = stream.apart_s;
    for (auto& [space, tree] : index_.trees) tree.finish();
    for (TopicContents& contents : index_.topics) {
      contents.poses.finish();
      std::ranges::stable_sort(contents.cameras, {}, &ListedCamera::stamp_ns);
    }
    return std::move(index_);
  }

 private:
  /// What has a time.
  struct Event {
    std::int64_t recorded_ns = 0;
    std::uint32_t stream = 0, index = 0;  ///< into streams_; of scans and cameras, in their topic
    Trajectory::Sample sample;            ///< of a pose; of all, their stamp
  };
  /// Messages stamped by one clock: one transform of tf, or one topic.
  struct Stream {
    std::size_t topic = 0;
    TransformTree* tree = nullptr;
    TransformTree::Edge edge{};
    bool moves = false;                                        ///< poses, but for fixed ones
    std::vector<std::uint32_t> recorded{};                     // its events, for a clock set back
    double apart_s = std::numeric_limits<double>::infinity();  // from the poses recorded before
  };

  void add_event(std::uint32_t stream, std::size_t index, const Trajectory::Sample& sample) {
    events_.push_back({now_ns_, stream, static_cast<std::uint32_t>(index), sample});
  }

  std::uint32_t stream_of(const Stream& stream) {
    const auto [found, is_new] = stream_indices_.try_emplace(
        {stream.topic, stream.edge.parent, stream.edge.child}, static_cast<std::uint32_t>(streams_.size()));
    if (is_new) streams_.push_back(stream);
    return found->second;
  }

  /// Some drivers have no clock and stamp 0; a simulation starts at 0 and continues.
  void give_stamps() {
    constexpr std::int64_t near_ns = 500000000;  // poses and scans come at 2 Hz at least
    const bool from_zero = std::ranges::any_of(events_, [&](const Event& event) {
      const Stream& stream = streams_[event.stream];
      const std::int64_t stamp = event.sample.stamp_ns;
      return (stream.moves || stream.tree == nullptr) && stamp != 0 && std::abs(stamp) < near_ns;
    });
    for (Event& event : events_)
      if (recorded_ || (event.sample.stamp_ns == 0 && !from_zero)) event.sample.stamp_ns = event.recorded_ns;
    for (TopicContents& contents : index_.topics)
      for (ListedMessage& scan : contents.scans)
        if (scan.header_ns == 0 && !from_zero) scan.header_ns = scan.stamp_ns;  // when it was recorded
  }

  /// "…: its clock is set back by 1.6 s"; empty: it is not. Messages that are logged late or twice go back,
  /// too, but their stamps are right: by these the way is the shorter one. By a clock that was set back by n
  /// samples it goes to and fro, n times as long; of a robot that stands both are alike.
  std::string set_back(const Stream& stream) const {
    constexpr double longer = 1.5;  // between 1 and the 2 of two samples
    const std::vector<std::uint32_t>& recorded = stream.recorded;
    const auto at = [&](std::size_t i) -> const Trajectory::Sample& { return events_[recorded[i]].sample; };
    const auto stamp = [&](std::size_t i) { return at(i).stamp_ns; };
    std::size_t back = 3;  // by more than the spacing, and not by one late message
    while (back < recorded.size() &&
           std::max(stamp(back - 1), stamp(back)) >= std::min(stamp(back - 3), stamp(back - 2)))
      ++back;
    if (back >= recorded.size()) return {};
    std::vector<std::uint32_t> sorted(recorded.size());
    std::iota(sorted.begin(), sorted.end(), 0U);
    std::ranges::stable_sort(sorted, {}, stamp);
    double by_stamp = 0, as_recorded = 0;  // m, where they differ
    bool begins_anew = false;              // all that follows is before all that was
    for (std::size_t i = 1, least = sorted[0]; i < sorted.size();
         least = std::min<std::size_t>(least, sorted[i++])) {
      begins_anew = begins_anew || least == sorted.size() - i;
      const std::size_t before = sorted[i - 1], next = before + 1;
      if (sorted[i] == next) continue;
      by_stamp += way(at(before), at(sorted[i]));
      if (next < sorted.size()) as_recorded += way(at(before), at(next));
    }
    if (!begins_anew && !(by_stamp > longer * as_recorded)) return {};
    return index_.topics[stream.topic].topic.name + ": its clock is set back by " +
           std::to_string(distance(stamp(back - 2), stamp(back - 1)) / 1e9) + " s";
  }

  /// Of a point a metre away, at most; 0 where a pose is none.
  static double way(const Trajectory::Sample& a, const Trajectory::Sample& b) {
    const Eigen::Vector4d p = a.rotation.coeffs(), q = b.rotation.coeffs();
    const double metres =
        (a.translation - b.translation).norm() + 2 * std::min((p - q).norm(), (p + q).norm());
    return std::isfinite(metres) ? metres : 0;
  }

  /// Finds a clock of poses that is set back, and how far apart those of scans and poses are.
  void compare_clocks() {
    std::int64_t now = lowest;  // of the poses
    for (std::size_t i = 0; i < events_.size(); ++i) {
      std::int64_t& stamp = events_[i].sample.stamp_ns;
      Stream& stream = streams_[events_[i].stream];
      if (stream.moves) {
        stream.recorded.push_back(static_cast<std::uint32_t>(i));
        now = stamp;
      } else if (stream.tree != nullptr) {
        stamp = now;  // it holds from now on, whatever clock its sender has
      } else if (now != lowest) {
        stream.apart_s = std::min(stream.apart_s, distance(stamp, now) / 1e9);
      }
    }
    for (const Stream& stream : streams_)
      if (index_.set_back.empty()) index_.set_back = set_back(stream);
  }

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
    if (!contents.is_depth) contents.is_depth = is_depth(contents, message.bytes);
    keep(bytes_of_scan);
    add_event(stream_of({message.topic}), contents.scans.size(), {header.stamp_ns});
    contents.scans.push_back({message.place, header.stamp_ns != 0 ? header.stamp_ns : now_ns_,
                              header.stamp_ns, static_cast<std::uint32_t>(message.topic),
                              frame_index(header.frame)});
  }

  static bool is_depth(TopicContents& contents, std::string_view bytes) {
    const BagTopic& topic = contents.topic;
    if (is_cloud_type(topic.type)) return true;
    try {
      const auto reader = message_reader(bytes, topic.encoding);
      if (topic.type == "sensor_msgs/CompressedImage") {
        const CompressedImageMessage image = read_compressed_image_message(*reader);
        if (contents.encoding.empty()) contents.encoding = image.format;
        return image.is_depth();
      }
      const std::string encoding = read_image_message(*reader).encoding;
      if (contents.encoding.empty()) contents.encoding = encoding;
      return depth_kind(encoding) != DepthKind::none;
    } catch (const std::runtime_error&) {
      return false;
    }
  }

  void add_pose_or_camera(TopicContents& contents, const BagMessage& message) {
    const std::string& type = contents.topic.type;
    const auto reader = message_reader(message.bytes, contents.topic.encoding);
    if (type == "tf2_msgs/TFMessage" || type == "tf/tfMessage") {
      const bool fixed = contents.topic.name.ends_with("tf_static");
      TransformTree& tree = index_.trees[namespace_of(contents.topic.name)];
      for_each_transform(*reader, [&](const TransformMessage& transform) {
        keep(sizeof(Event));
        const TransformTree::Edge edge{transform.header.frame, transform.child_frame, fixed};
        const std::size_t streams = streams_.size();
        add_event(stream_of({message.topic, &tree, edge, !fixed}), 0, sample_of(transform));
        if (streams_.size() > streams)
          keep(bytes_of_frame + 6 * (transform.header.frame.size() + transform.child_frame.size()));
      });
    } else if (is_pose_type(type)) {
      std::vector<TransformMessage> poses = read_pose_message(*reader, type);
      if (poses.empty()) return;
      if (recorded_) poses.erase(poses.begin(), poses.end() - 1);  // recorded at its time
      if (contents.pose_parent.empty()) {
        contents.pose_parent = poses.front().header.frame;
        contents.pose_child = poses.front().child_frame;
      }
      for (const TransformMessage& pose : poses) add_pose(message.topic, pose, type == "nav_msgs/Path");
    } else if (type == "sensor_msgs/CameraInfo") {
      add_camera(contents, message.topic,
                 read_header(*message_reader(message.bytes, contents.topic.encoding)),
                 read_camera_info(*reader));
    } else if (type == "std_msgs/Float32") {
      contents.unit_m = static_cast<double>(reader->f32());
    }
  }

  /// Each message of a path holds those before, too, perhaps corrected since.
  void add_pose(std::size_t topic, const TransformMessage& pose, bool of_path) {
    const auto [known, is_new] = of_path
                                     ? path_events_.try_emplace({topic, pose.header.stamp_ns}, events_.size())
                                     : std::pair(path_events_.end(), true);
    if (!is_new) {
      events_[known->second].sample = sample_of(pose);
      return;
    }
    keep(of_path ? 2 * sizeof(Event) : sizeof(Event));
    add_event(stream_of({topic, nullptr, {}, true}), 0, sample_of(pose));
  }

  /// Where it changes; an uncalibrated one, from a driver that is starting, only until another comes.
  void add_camera(TopicContents& contents, std::size_t topic, const MessageHeader& header,
                  const CameraInfoMessage& camera) {
    std::vector<ListedCamera>& cameras = contents.cameras;
    if (!cameras.empty() && (cameras.back().camera == camera || !camera.calibrated())) return;
    if (!cameras.empty() && !cameras.back().camera.calibrated()) {
      cameras.back().camera = camera;  // it holds from the first on
      return;
    }
    keep(bytes_of_scan);
    add_event(stream_of({topic}), cameras.size(), {header.stamp_ns});
    cameras.push_back({header.stamp_ns, camera});
  }

  static Trajectory::Sample sample_of(const TransformMessage& transform) {
    return {transform.header.stamp_ns, transform.translation,
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

  static constexpr std::int64_t lowest = std::numeric_limits<std::int64_t>::min();

  std::string name_;
  std::uint64_t budget_ = 0, kept_ = 0;
  bool recorded_;
  std::vector<std::string>* left_out_;
  std::size_t file_ = 0;
  std::int64_t now_ns_ = lowest;  // when the message was recorded
  std::deque<Event> events_;
  std::map<std::pair<std::size_t, std::int64_t>, std::size_t> path_events_;  // by topic and stamp
  std::vector<Stream> streams_;
  std::map<std::tuple<std::size_t, std::string, std::string>, std::uint32_t> stream_indices_;
  BagIndex index_;
  std::map<std::string, std::uint32_t> frame_indices_;
};

}  // namespace

std::string namespace_of(const std::string& topic) {
  return topic.substr(0, topic.find('/') == std::string::npos ? 0 : topic.rfind('/'));  // ROS 1 has "tf", too
}

BagIndex index_bag(Bag& bag, const std::string& name, std::uint64_t bytes, bool recorded,
                   std::vector<std::string>* left_out) {
  Indexer indexer(name, bytes, recorded, left_out);
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
