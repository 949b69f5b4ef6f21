#include "io/readers/bag_recording.hpp"
#include "io/readers/bounded_file.hpp"
#include "io/readers/pose_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <set>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Linear interpolation between poses T apart deviates by at most a·T²/8 for an acceleration a: 16 mm for the
// 2 m/s² of a walking robot, less than a voxel.
constexpr double default_gap_s = 0.25;

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

/// Of a type that is not read, with messages of the size of a hundred points.
bool may_be_cloud(const TopicContents& topic) {
  constexpr std::uint64_t least_bytes = 100 * sizeof(Eigen::Vector3f);
  return topic.messages > 0 && topic.scans.empty() && topic.empty_scans == 0 &&
         topic.bytes / topic.messages >= least_bytes && !topic.topic.type.starts_with("tf") &&
         !is_pose_type(topic.topic.type);
}

/// Names of robot or sensor frames, in which an arm or a leg may move.
bool is_named_as_part(const std::string& frame) {
  for (const char* const part :
       {"base", "body", "link", "robot", "imu", "lidar", "laser", "velodyne", "ouster", "os_", "livox",
        "hesai", "rslidar", "sensor", "camera", "depth", "optical"})
    if (frame.find(part) != std::string::npos) return true;
  return false;
}

}  // namespace

BagRecording::BagRecording(const std::vector<std::filesystem::path>& files, const ScanSourceOptions& options,
                           std::vector<std::string>& left_out)
    : files_(files),
      bag_(open_bag(files)),
      depth_scale_(options.depth_scale),
      none_(options.clear_no_return_m > 0 ? NoReturn::far : NoReturn::left_out),
      posed_(!options.poses) {
  for (const auto& file : files_) bytes_ += size_of_bag_file(file);
  gap_ns_ = static_cast<std::int64_t>(1e9 * std::min(options.max_pose_gap_s.value_or(default_gap_s), 1e9));
  index_ = index_bag(*bag_, files_.front().string(), bytes_, options.bag.recorded_stamps,
                     options.skip_bad ? &left_out : nullptr);
}

bool BagRecording::has_scans() const { return std::ranges::any_of(index_.topics, holds_scans); }

void BagRecording::choose(const ScanSourceOptions& options, std::vector<std::string>& left_out) {
  choose_scans(options.bag);
  choose_cameras(options);
  choose_tree();
  notes_.insert(notes_.end(), index_.notes.begin(), index_.notes.end());
  if (!posed_) return;
  choose_poses(options.bag);
  require_one_clock();
  settle_doubts(options.bag);
  note_left_out();
  leave_out_jumps(left_out);
}

void BagRecording::refuse(const std::string& what, const std::string& hint) const {
  throw Error(Error::Kind::data, files_.front().string(), what, hint);
}

const TopicContents& BagRecording::named(const std::string& topic, const char* option, const char* what,
                                         bool (*fits)(const TopicContents&)) const {
  for (const TopicContents& contents : index_.topics)
    if (contents.topic.name == topic && fits(contents)) return contents;
  refuse(std::string("no topic ") + topic + " with " + what + ", as " + option + " requires",
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
      const std::string others = list_of(index_.topics, may_be_cloud);
      refuse("no topic with point clouds or depth images" +
                 (others == "none" ? "" : "; of a type that is not read, but large: " + others),
             others == "none" ? "octosurf info lists the bag's topics and frames"
                              : "record PointCloud2, or convert them to it");
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
  }
}

void BagRecording::choose_camera(const TopicContents& images) {
  const std::string name =
      camera_info_topic(images.topic.name, images.topic.type == "sensor_msgs/CompressedImage");
  const auto found = std::find_if(
      index_.topics.begin(), index_.topics.end(),
      [&](const TopicContents& topic) { return topic.topic.name == name && holds_camera(topic); });
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
  if (first.distorted && !of_p)
    notes_.push_back("camera: the lens' distortion that " + name + " tells of is not undone");
  if (const std::size_t changes = found->cameras.size() - 1; changes > 0)
    notes_.push_back("camera: " + name + " changes " + count_of(changes, "time") +
                     "; each image is read by the last before it of its size");
}

/// Of several trees with the same frames, the one in the scans' namespace.
void BagRecording::choose_tree() {
  std::map<std::string, TransformTree>& trees = index_.trees;
  const auto own = [&](const ListedMessage& scan) {
    auto found = trees.end();
    for (auto at = trees.begin(); at != trees.end(); ++at)  // "/a/b" after "/a"
      if (at->second.knows(index_.frames[scan.frame]) &&
          index_.topics[scan.topic].topic.name.starts_with(at->first + "/"))
        found = at;
    return found;
  };
  auto chosen = own(scans_.front());
  const bool sure = std::ranges::all_of(
      scans_, [&](const ListedMessage& scan) { return chosen != trees.end() && own(scan) == chosen; });
  if (chosen == trees.end()) chosen = trees.begin();
  if (chosen != trees.end()) tree_ = std::move(chosen->second);
  std::string others;
  for (auto at = trees.begin(); at != trees.end(); ++at)
    if (at != chosen && !tree_.join(at->second)) others += (others.empty() ? "" : ", ") + at->first + "/tf";
  if (others.empty()) return;
  if (!sure)
    refuse(
        "frames of " + chosen->first + "/tf are in " + others + ", too, and the scans in no one's namespace",
        "keep one robot's tf in the bag, or give --poses FILE");
  notes_.push_back("tf: " + chosen->first + "/tf, not " + others);
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
  const auto [parents, disagreement, changed] =
      tree_.doubts_of(robot_.empty() ? index_.frames[scans_.front().frame] : robot_);
  if (!changed.empty())
    notes_.push_back("poses: " + changed + " is fixed, but changes: each holds from its time on");
  if (!options.fixed_frame && !parents.empty()) refuse("tf: " + parents, "choose by --fixed-frame");
  if (!options.fixed_frame && !disagreement.empty())
    refuse("tf: " + disagreement,
           "record one; --fixed-frame takes a frame below, or both as they are, --pose-topic an odometry");
  if (!disagreement.empty()) notes_.push_back("poses: " + disagreement);
}

void BagRecording::choose_poses(const BagOptions& options) {
  if (options.pose_topic && options.fixed_frame)
    throw Error(Error::Kind::usage, "--pose-topic", "and --fixed-frame are two sources of poses", "give one");
  if (options.pose_frame && options.fixed_frame)
    throw Error(Error::Kind::usage, "--pose-frame", "is of a pose topic, and --fixed-frame of tf",
                "give one");
  const std::string& frame = index_.frames[scans_.front().frame];
  if (options.pose_topic)
    return choose_pose_topic(named(*options.pose_topic, "--pose-topic", "poses", holds_poses), options);
  if (choose_registered(frame, options)) return;
  if (options.fixed_frame) {
    if (!tree_.knows(*options.fixed_frame))
      refuse("tf has no frame " + *options.fixed_frame, "octosurf info lists the bag's topics and frames");
    return choose_fixed_frame(*options.fixed_frame, "");
  }
  if (!options.pose_frame && tree_.moves(frame))
    return choose_fixed_frame("", "--fixed-frame or --pose-topic choose others");
  std::vector<const TopicContents*> topics;
  for (const TopicContents& topic : index_.topics)
    if (holds_poses(topic)) topics.push_back(&topic);
  if (topics.size() == 1) return choose_pose_topic(*topics.front(), options);
  if (topics.size() > 1)
    refuse("tf does not move frame '" + frame + "', and " + std::to_string(topics.size()) +
               " topics have poses: " + list_of(index_.topics, holds_poses),
           "choose by --pose-topic");
  if (tree_.knows(frame)) return choose_fixed_frame("", "nothing moves it");
  refuse("no poses: neither tf of frame '" + frame + "' nor a topic with poses",
         "give --poses FILE, or record /tf and /tf_static");
}

/// Clouds that lidar odometry has moved to its map frame: the sensor's pose is from tf or odometry. False:
/// they are in a sensor's frame.
bool BagRecording::choose_registered(const std::string& frame, const BagOptions& options) {
  if (!is_cloud_type(index_.topics[scans_.front().topic].topic.type)) return false;
  const auto poses_in_it = [&](const TopicContents& topic) {
    return holds_poses(topic) && topic.pose_parent == frame && topic.pose_child != frame;
  };
  const bool by_topic = std::ranges::any_of(index_.topics, poses_in_it);
  std::string robot = tree_.robot_below(frame);
  const bool stands = is_map_frame(frame) ||
                      (tree_.ancestors(frame).size() == 1 && !robot.empty() && !is_named_as_part(frame));
  if (!stands && !by_topic) return false;
  if (options.pose_frame) {
    const auto above = tree_.ancestors(*options.pose_frame);
    robot = std::ranges::find(above, frame) != above.end() ? *options.pose_frame : std::string();
  }
  if (robot.empty() && by_topic) return false;             // choose_pose_topic() goes on
  if (robot.empty() && options.fixed_frame) return false;  // as if seen from its origin, as is stated
  if (robot.empty())
    refuse("its clouds are in fixed frame '" + frame + "' and no sensor pose is known",
           "record tf or odometry of the robot in it; --pose-frame names the robot's frame, --fixed-frame " +
               frame + " takes its origin");
  choose_fixed_frame(options.fixed_frame.value_or(""), "");
  robot_ = robot;
  notes_.back() = "poses: tf of " + robot_ + " in " + fixed_frame_ + "; clouds are in " + frame +
                  ", and their rays start at " + robot_ + " (else --pose-frame)";
  return true;
}

/// Default: `map` (REP 105) if the sensor is below it, else the tree's root.
void BagRecording::choose_fixed_frame(const std::string& frame, const std::string& why) {
  const std::string& sensor = index_.frames[scans_.front().frame];
  fixed_frame_ = frame;
  if (frame.empty()) {
    const auto names = tree_.ancestors(sensor);
    fixed_frame_ = std::find(names.begin(), names.end(), "map") != names.end() ? "map" : names.back();
  }
  notes_.push_back("poses: tf of " + sensor + " in " + fixed_frame_ + (why.empty() ? "" : " (" + why + ")"));
}

void BagRecording::choose_pose_topic(const TopicContents& topic, const BagOptions& options) {
  pose_topic_ = &topic;
  tree_.hold_steady();
  pose_child_ = options.pose_frame.value_or(topic.pose_child);
  const std::string& sensor = index_.frames[scans_.front().frame];
  const bool one_frame = std::all_of(scans_.begin(), scans_.end(), [&](const ListedMessage& scan) {
    return scan.frame == scans_.front().frame;
  });
  if (pose_child_.empty() && !one_frame)
    refuse("the poses of " + topic.topic.name + " name no frame, and the scans are of several",
           "name it by --pose-frame");
  if (topic.pose_parent == sensor && pose_child_ != sensor) {
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

void BagRecording::leave_out_jumps(std::vector<std::string>& left_out) {
  for (TopicContents& topic : index_.topics) topic.poses.find_jumps();
  tree_.find_jumps();
  const std::string& scans = robot_.empty() ? index_.frames[scans_.front().frame] : robot_;
  const std::string& top = pose_topic_ ? pose_child_ : fixed_frame_;
  std::vector<const Trajectory*> tracks = tree_.moving_between(top, scans);
  if (pose_topic_) tracks.push_back(&pose_topic_->poses);
  for (const Trajectory* track : tracks) {
    if (track->jumps().empty()) continue;
    jumps_.insert(jumps_.end(), track->jumps().begin(), track->jumps().end());
    notes_.push_back(text_of_jumps(*track));
  }
  const auto in_jump = [&](const ListedMessage& scan) {
    return std::ranges::any_of(jumps_, [&](const auto& jump) { return jump.holds(scan.stamp_ns); });
  };
  if (std::ranges::all_of(scans_, in_jump)) return;  // each is refused when its turn comes
  std::erase_if(scans_, [&](const ListedMessage& scan) {
    if (!in_jump(scan)) return false;
    left_out.push_back(name_of(scan) + ": no pose at its time (they jump there); left out");
    return true;
  });
}

}  // namespace octosurf::io
