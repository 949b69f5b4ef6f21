#include "io/readers/bag_recording.hpp"
#include "io/readers/bounded_file.hpp"
#include "io/readers/pose_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <regex>
#include <set>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

bool holds_scans(const TopicContents& topic) { return topic.is_depth && !topic.scans.empty(); }
bool holds_empty_scans(const TopicContents& topic) { return topic.empty_scans > 0; }
bool holds_poses(const TopicContents& topic) { return !topic.poses.samples().empty(); }
bool holds_camera(const TopicContents& topic) { return !topic.cameras.empty(); }

std::string list_of(const std::vector<TopicContents>& topics, bool (*fits)(const TopicContents&)) {
  std::string list;
  for (const TopicContents& topic : topics)
    if (fits(topic)) list += (list.empty() ? "" : ", ") + topic.topic.name + " (" + topic.topic.type + ")";
  return list.empty() ? "none" : list;
}

/// "; not read as poses: /twist (geometry_msgs/TwistStamped)", of what says by its type where something is.
std::string unread(const std::vector<TopicContents>& topics) {
  const std::string list = list_of(topics, [](const TopicContents& topic) {
    static const std::regex tells("Pose|Odom|Path|Twist|TransformStamped|NavSat");
    return topic.messages > 0 && !holds_poses(topic) && std::regex_search(topic.topic.type, tells);
  });
  return list == "none" ? "" : "; not read as poses: " + list;
}

/// ", of which …": topics that hold no scans as they are, with the way to make some.
std::pair<std::string, std::string> nearly_scans(const std::vector<TopicContents>& topics) {
  constexpr std::array makers{
      std::pair("velodyne_msgs/", "velodyne_pointcloud"), std::pair("ouster_", "ouster_ros's os_cloud"),
      std::pair("hesai", "hesai_ros_driver"), std::pair("pandar_msgs/", "hesai_ros_driver"),
      std::pair("livox", "livox_ros_driver2")};
  std::string packets, images, maker;
  for (const TopicContents& topic : topics) {
    const std::string& type = topic.topic.type;
    const std::string name = topic.topic.name + " (";
    for (const auto& [prefix, by] : makers) {
      if (topic.messages == 0 || !type.starts_with(prefix) || is_cloud_type(type) ||
          (type.find("acket") == std::string::npos && type.find("Scan") == std::string::npos &&
           type.find("Udp") == std::string::npos))
        continue;
      packets += (packets.empty() ? "" : ", ") + name + type + ")";
      maker = by;
    }
    if (!topic.encoding.empty()) images += (images.empty() ? "" : ", ") + name + topic.encoding + ")";
  }
  if (!packets.empty())
    return {"; a lidar's packets: " + packets, maker + " turns them into PointCloud2: record that"};
  if (!images.empty())
    return {"; images of encodings that are not read: " + images, "depth is 16UC1, mono16 or 32FC1"};
  return {"", "octosurf info lists the bag's topics and frames"};
}

}  // namespace

BagRecording::BagRecording(const std::vector<std::filesystem::path>& files, const ScanSourceOptions& options,
                           std::vector<std::string>& left_out)
    : files_(files), bag_(open_bag(files)), depth_scale_(options.depth_scale), posed_(!options.poses) {
  for (const auto& file : files_) bytes_ += size_of_bag_file(file);
  index_ = index_bag(*bag_, files_.front().string(), bytes_, options.bag.recorded_stamps,
                     options.skip_bad ? &left_out : nullptr);
}

bool BagRecording::has_scans() const { return std::ranges::any_of(index_.topics, holds_scans); }

void BagRecording::choose(const ScanSourceOptions& options) {
  choose_scans(options.bag);
  choose_cameras(options);
  choose_tree();
  in_map_ = options.pose_form == PoseForm::in_map;
  if (!posed_) return;
  if (!index_.set_back.empty())
    refuse(index_.set_back, "--stamps recorded takes the recorder's time, or cut the bag there");
  choose_poses(options.bag);
  require_one_clock();
  settle_doubts(options.bag);
  note_left_out();
}

void BagRecording::refuse(const std::string& what, const std::string& hint) const {
  throw Error(Error::Kind::data, files_.front().string(), what, hint);
}

const TopicContents& BagRecording::named(const std::string& topic, const char* option, const char* what,
                                         bool (*fits)(const TopicContents&)) const {
  for (const TopicContents& contents : index_.topics)
    if (contents.topic.name == topic && fits(contents)) return contents;
  refuse(std::string("no topic ") + topic + " with " + what + ", as " + option + " requires" +
             (fits == holds_poses ? unread(index_.topics) : ""),
         "there are: " + list_of(index_.topics, fits));
}

void BagRecording::choose_scans(const BagOptions& options) {
  std::vector<const TopicContents*> chosen;
  if (options.topics.empty()) {
    for (const TopicContents& topic : index_.topics)
      if (holds_scans(topic)) chosen.push_back(&topic);
    if (chosen.empty()) {
      if (const std::string empty = list_of(index_.topics, holds_empty_scans); empty != "none")
        refuse("no message of " + empty + " holds a point", "record it again");
      const auto [others, way_out] = nearly_scans(index_.topics);
      refuse("no topic with point clouds or depth images" + others, way_out);
    }
    if (chosen.size() > 1)
      refuse(count_of(chosen.size(), "topic") + " with scans: " + list_of(index_.topics, holds_scans),
             "choose by --topic");
  }
  for (const std::string& name : std::set<std::string>(options.topics.begin(), options.topics.end()))
    chosen.push_back(&named(name, "--topic", "point clouds or depth images", holds_scans));
  for (const TopicContents* topic : chosen) {
    scans_.insert(scans_.end(), topic->scans.begin(), topic->scans.end());
    notes_.push_back(
        "scans: " + count_of(topic->scans.size(), "message") + " of " + topic->topic.name + " (" +
        topic->topic.type + ")" +
        (topic->empty_scans == 0 ? "" : ", " + std::to_string(topic->empty_scans) + " more without points"));
  }
  std::ranges::stable_sort(scans_, {}, &ListedMessage::stamp_ns);
}

void BagRecording::choose_cameras(const ScanSourceOptions& options) {
  std::set<std::uint32_t> topics;
  for (const ListedMessage& scan : scans_)
    if (!is_cloud_type(index_.topics[scan.topic].topic.type)) topics.insert(scan.topic);
  for (const std::uint32_t topic : topics) {
    if (options.intrinsics)
      cameras_[topic] = {read_intrinsics(*options.intrinsics)};
    else
      choose_camera(index_.topics[topic]);
    choose_unit(index_.topics[topic]);
  }
}

void BagRecording::choose_camera(const TopicContents& images) {
  const std::string name =
      camera_info_topic(images.topic.name, images.topic.type == "sensor_msgs/CompressedImage");
  const auto found = std::ranges::find_if(index_.topics, [&](const TopicContents& topic) {
    return topic.topic.name == name && holds_camera(topic);
  });
  if (found == index_.topics.end())
    refuse("no camera for " + images.topic.name + ": no CameraInfo on " + name +
               "; there are: " + list_of(index_.topics, holds_camera),
           "give --intrinsics FILE");
  const CameraInfoMessage& first = found->cameras.front().camera;
  const bool rectified = is_rectified(images.topic.name);
  const bool of_p = with_place([&] { return &intrinsics_for(first, rectified) == &first.rectified; },
                               [&](const std::string& what) {
                                 return Error(Error::Kind::data, files_.front().string() + " " + name, what,
                                              "give --intrinsics FILE");
                               });
  cameras_[images.scans.front().topic] = {{}, &*found, rectified};
  notes_.push_back("camera: " + name + " (its " + (of_p ? "P, of rectified images)" : "K)"));
  if (const Lens* lens = lens_of(first, rectified); lens != nullptr)
    notes_.push_back("camera: its distortion (" + lens->model + ") is " +
                     (is_known(*lens) ? "" : "of a model that is not read, and not ") + "undone");
  if (const std::size_t changes = found->cameras.size() - 1; changes > 0)
    notes_.push_back("camera: " + name + " changes " + count_of(changes, "time") +
                     "; each image is read by the last before it of its size");
}

/// librealsense records the metres of a unit beside its images.
void BagRecording::choose_unit(const TopicContents& images) {
  for (const TopicContents& topic : index_.topics) {
    const std::size_t end = topic.topic.name.rfind("option/Depth_Units/value");
    if (end == std::string::npos || !(topic.unit_m > 0) ||
        !images.topic.name.starts_with(topic.topic.name.substr(0, end)))
      continue;
    units_[images.scans.front().topic] = 1 / topic.unit_m;
    if (!depth_scale_)
      notes_.push_back("unit: " + topic.topic.name +
                       formatted(" says %g m; --depth-scale states another", topic.unit_m));
  }
}

/// The only tf, or that of the scans' namespace.
void BagRecording::choose_tree() {
  std::map<std::string, TransformTree>& trees = index_.trees;
  auto chosen = trees.size() == 1 ? trees.begin() : trees.end();
  std::string names;
  for (auto at = trees.begin(); at != trees.end() && trees.size() > 1; ++at) {  // "/a/b" after "/a"
    names += (names.empty() ? "" : ", ") + at->first + "/tf";
    const ListedMessage& scan = scans_.front();
    if (at->second.knows(index_.frames[scan.frame]) &&
        index_.topics[scan.topic].topic.name.starts_with(at->first + "/"))
      chosen = at;
  }
  if (chosen == trees.end()) {
    if (trees.empty() || !posed_) return;
    refuse("several tf: " + names + ", and the scans' frame in none of their namespace",
           "keep one robot's tf in the bag, or give --poses FILE");
  }
  if (!names.empty()) notes_.push_back("tf: " + chosen->first + "/tf, of " + names);
  tree_ = std::move(chosen->second);
}

/// A driver may stamp scans by a clock of its own, such as the time since it began.
void BagRecording::require_one_clock() const {
  const TopicContents& scans = index_.topics[scans_.front().topic];
  constexpr double least_s = 60;  // no recorder keeps a message for a minute
  if (scans.apart_s < least_s || !(pose_topic_ || tree_.moves(index_.frames[scans_.front().frame]))) return;
  constexpr double hour_s = 3600, year_s = 365.25 * 24 * hour_s;
  const bool years = scans.apart_s > year_s;
  refuse(scans.topic.name + formatted(" is stamped %.3f s, %.3g %s from the poses recorded then: two clocks",
                                      static_cast<double>(scans_.front().header_ns) / 1e9,
                                      scans.apart_s / (years ? year_s : hour_s), years ? "years" : "hours"),
         "--stamps recorded takes the recorder's time for both");
}

/// Ambiguous tf is refused unless the options decide.
void BagRecording::settle_doubts(const BagOptions& options) {
  if (pose_topic_) return;
  const auto [parents, changed] =
      tree_.doubts_of(robot_.empty() ? index_.frames[scans_.front().frame] : robot_);
  if (!changed.empty())
    notes_.push_back("poses: " + changed + " is fixed, but changes: each holds from its time on");
  if (!options.fixed_frame && !parents.empty()) refuse("tf: " + parents, "choose by --fixed-frame");
}

void BagRecording::choose_poses(const BagOptions& options) {
  if (options.pose_topic && options.fixed_frame)
    throw Error(Error::Kind::usage, "--pose-topic", "and --fixed-frame are two sources of poses", "give one");
  std::string& frame = index_.frames[scans_.front().frame];
  if (in_map_ && options.pose_frame && !tree_.knows(frame) && tree_.knows(*options.pose_frame))
    frame = options.fixed_frame.value_or(tree_.ancestors(*options.pose_frame).back());
  if (options.pose_topic)
    return choose_pose_topic(named(*options.pose_topic, "--pose-topic", "poses", holds_poses), options);
  if (options.fixed_frame) {
    if (!tree_.knows(*options.fixed_frame)) refuse(tree_.lacks(*options.fixed_frame), "choose one of these");
    return choose_fixed_frame(options, "");
  }
  if (!options.pose_frame && tree_.moves(frame))
    return choose_fixed_frame(options, "--fixed-frame or --pose-topic choose others");
  std::vector<const TopicContents*> topics;
  for (const TopicContents& topic : index_.topics)
    if (holds_poses(topic)) topics.push_back(&topic);
  if (topics.size() == 1) return choose_pose_topic(*topics.front(), options);
  if (topics.size() > 1)
    refuse("tf does not move frame '" + frame + "', and " + std::to_string(topics.size()) +
               " topics have poses: " + list_of(index_.topics, holds_poses),
           "choose by --pose-topic");
  if (tree_.knows(frame))
    return choose_fixed_frame(options, tree_.moves(frame) ? "" : "nothing moves it" + unread(index_.topics));
  refuse("no poses: " + tree_.lacks(frame) + ", and no topic has poses" + unread(index_.topics),
         "give --poses FILE, or record /tf; for clouds in the map, --pose-form in-map --pose-frame FRAME");
}

/// Default: `map` (REP 105) if the sensor is below it, else the tree's root.
void BagRecording::choose_fixed_frame(const BagOptions& options, const std::string& why) {
  const std::string& frame = index_.frames[scans_.front().frame];
  const auto names = tree_.ancestors(frame);
  const bool below_map = std::ranges::find(names, "map") != names.end();
  fixed_frame_ = options.fixed_frame ? *options.fixed_frame : below_map ? "map" : names.back();
  notes_.push_back("poses: tf of " + frame + " in " + fixed_frame_ + (why.empty() ? "" : " (" + why + ")"));
  if (!is_cloud_type(index_.topics[scans_.front().topic].topic.type)) return;
  if (!options.pose_frame && frame == fixed_frame_ && tree_.moves_below(frame))
    refuse("its clouds are in the map's frame '" + frame + "', and nothing says where they were seen from",
           "--pose-frame FRAME names the sensor's in tf (" + frame + ": its origin), --pose-topic its poses");
  if (!options.pose_frame || *options.pose_frame == frame) return;
  robot_ = *options.pose_frame;
  notes_.back() = "poses: tf of " + robot_ + " in " + fixed_frame_ + "; clouds are in " + frame +
                  ", and their rays start at " + robot_;
}

void BagRecording::choose_pose_topic(const TopicContents& topic, const BagOptions& options) {
  pose_topic_ = &topic;
  tree_.hold_steady();
  pose_child_ = options.pose_frame.value_or(topic.pose_child);
  const std::string& sensor = index_.frames[scans_.front().frame];
  const bool one_frame = std::ranges::all_of(
      scans_, [&](const ListedMessage& scan) { return scan.frame == scans_.front().frame; });
  if (pose_child_.empty() && !one_frame)
    refuse("the poses of " + topic.topic.name + " name no frame, and the scans are of several",
           "name it by --pose-frame");
  const bool undone = in_map_ && !tree_.newest(pose_child_, sensor);
  if ((topic.pose_parent == sensor || undone) && pose_child_ != sensor) {
    robot_ = pose_child_.empty() ? "the poses' places" : pose_child_;
    notes_.push_back("poses: " + topic.topic.name + " (" + topic.topic.type + "); clouds are in " + sensor +
                     ", as the poses are, and their rays start at " + robot_);
    return;
  }
  std::string of =
      pose_child_.empty() ? sensor + " (the sensor, as they name no frame; else --pose-frame)" : pose_child_;
  if (!pose_child_.empty() && pose_child_ != sensor) of += ", and tf from there to " + sensor;
  notes_.push_back("poses: " + topic.topic.name + " (" + topic.topic.type + ") in " + topic.pose_parent +
                   " of " + of);
}

void BagRecording::note_left_out() {
  const auto [bad, frame] =
      pose_topic_ ? std::pair(pose_topic_->poses.left_out(), pose_topic_->topic.name) : tree_.left_out();
  if (bad == 0) return;
  notes_.push_back("poses: " + count_of(bad, "sample") +
                   " left out, not finite or with a quaternion farther " + "than 1 % from length 1 (" +
                   (pose_topic_ ? "on " : "the first of frame ") + frame + "); poses there are interpolated");
}

}  // namespace octosurf::io
