#include "io/readers/bag_recording.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/readers/pose_file.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>
#include <stdexcept>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

// Linear interpolation between poses T apart deviates by at most a·T²/8 for an acceleration a: 16 mm for the
// 2 m/s² of a walking robot, less than a voxel.
constexpr double default_gap_s = 0.25;

bool holds_scans(const TopicContents& topic) { return topic.is_depth && !topic.scans.empty(); }
bool holds_empty_scans(const TopicContents& topic) { return topic.empty_scans > 0; }
bool holds_poses(const TopicContents& topic) { return !topic.poses.samples().empty(); }
bool holds_camera(const TopicContents& topic) { return topic.camera.has_value(); }

std::string list_of(const std::vector<TopicContents>& topics, bool (*fits)(const TopicContents&)) {
  std::string list;
  for (const TopicContents& topic : topics)
    if (fits(topic)) list += (list.empty() ? "" : ", ") + topic.topic.name + " (" + topic.topic.type + ")";
  return list.empty() ? "none" : list;
}

bool is_cloud(const TopicContents& topic) { return is_cloud_type(topic.topic.type); }

/// Of a type that is not read, with messages of the size of a hundred points.
bool may_be_cloud(const TopicContents& topic) {
  constexpr std::uint64_t least_bytes = 100 * sizeof(Eigen::Vector3f);
  return topic.messages > 0 && topic.scans.empty() && topic.empty_scans == 0 &&
         topic.bytes / topic.messages >= least_bytes && !topic.topic.type.starts_with("tf") &&
         !is_pose_type(topic.topic.type);
}

/// A frame called like this is of a robot or sensor, though an arm or a leg may move in it.
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
  for (const auto& file : files_) bytes_ += std::filesystem::file_size(file);
  gap_ns_ = static_cast<std::int64_t>(1e9 * std::min(options.max_pose_gap_s.value_or(default_gap_s), 1e9));
  index_ = index_bag(*bag_, files_.front().string(), bytes_, options.skip_bad ? &left_out : nullptr);
  choose_scans(options.bag);
  choose_cameras(options);
  if (posed_) choose_poses(options.bag);
  if (posed_) note_left_out();
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
    if (!is_cloud(index_.topics[scan.topic])) topics.insert(scan.topic);
  if (options.bag.info_topic && topics.size() > 1)
    throw Error(Error::Kind::usage, "--info-topic",
                "is of one camera, but images of " + count_of(topics.size(), "topic") + " are chosen",
                "map them one after the other");
  for (const std::uint32_t topic : topics) {
    if (options.intrinsics)
      cameras_[topic] = {read_intrinsics(*options.intrinsics), {}, {}};
    else
      choose_camera(index_.topics[topic], options.bag.info_topic);
  }
}

void BagRecording::choose_camera(const TopicContents& images, const std::optional<std::string>& info_topic) {
  const std::string name = info_topic.value_or(
      camera_info_topic(images.topic.name, images.topic.type == "sensor_msgs/CompressedImage"));
  const auto found = std::find_if(
      index_.topics.begin(), index_.topics.end(),
      [&](const TopicContents& topic) { return topic.topic.name == name && holds_camera(topic); });
  if (found == index_.topics.end())
    refuse("no camera for " + images.topic.name + ": no CameraInfo on " + name +
               "; there are: " + list_of(index_.topics, holds_camera),
           "choose by --info-topic, or give --intrinsics FILE");
  const CameraInfoMessage& info = *found->camera;
  const bool rectified = is_rectified(images.topic.name);
  with_place(
      [&] {
        cameras_[images.scans.front().topic] = {intrinsics_for(info, rectified), info.width, info.height};
      },
      [&](const std::string& what) {
        return Error(Error::Kind::data, files_.front().string() + " " + name, what, "give --intrinsics FILE");
      });
  notes_.push_back("camera: " + name + " (its " + (rectified ? "P, of rectified images)" : "K)"));
  if (info.distorted && !rectified)
    notes_.push_back("camera: the lens' distortion that " + name + " tells of is not undone");
  if (found->camera_changes)
    notes_.push_back("camera: " + name + " changes in the course of the bag; its first message is taken");
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
    if (!index_.tree.knows(*options.fixed_frame))
      refuse("tf has no frame " + *options.fixed_frame, "octosurf info lists the bag's topics and frames");
    return choose_fixed_frame(*options.fixed_frame, "");
  }
  if (!options.pose_frame && index_.tree.moves(frame))
    return choose_fixed_frame("", "--fixed-frame or --pose-topic choose others");
  std::vector<const TopicContents*> topics;
  for (const TopicContents& topic : index_.topics)
    if (holds_poses(topic)) topics.push_back(&topic);
  if (topics.size() == 1) return choose_pose_topic(*topics.front(), options);
  if (topics.size() > 1)
    refuse("tf does not move frame '" + frame + "', and " + std::to_string(topics.size()) +
               " topics have poses: " + list_of(index_.topics, holds_poses),
           "choose by --pose-topic");
  if (index_.tree.knows(frame)) return choose_fixed_frame("", "nothing moves it");
  refuse("no poses: neither tf of frame '" + frame + "' nor a topic with poses",
         "give --poses FILE, or record /tf and /tf_static");
}

/// Clouds that an odometry by lidar has moved to the frame of its map: tf or the odometry knows from where
/// they were seen. False: they are in a sensor's frame.
bool BagRecording::choose_registered(const std::string& frame, const BagOptions& options) {
  if (!is_cloud(index_.topics[scans_.front().topic])) return false;
  const auto poses_in_it = [&](const TopicContents& topic) {
    return holds_poses(topic) && topic.pose_parent == frame && topic.pose_child != frame;
  };
  const bool by_topic = std::ranges::any_of(index_.topics, poses_in_it);
  std::string robot = index_.tree.robot_below(frame);
  const bool stands = is_map_frame(frame) || (index_.tree.ancestors(frame).size() == 1 && !robot.empty() &&
                                              !is_named_as_part(frame));
  if (!stands && !by_topic) return false;
  if (options.pose_frame) {
    const auto above = index_.tree.ancestors(*options.pose_frame);
    robot = std::ranges::find(above, frame) != above.end() ? *options.pose_frame : std::string();
  }
  if (robot.empty() && by_topic) return false;             // choose_pose_topic() goes on
  if (robot.empty() && options.fixed_frame) return false;  // as if seen from its origin, as is stated
  if (robot.empty())
    refuse("its clouds are in frame '" + frame +
               "', which is no sensor's, and where they were seen from is not found",
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
    const auto names = index_.tree.ancestors(sensor);
    fixed_frame_ = std::find(names.begin(), names.end(), "map") != names.end() ? "map" : names.back();
  }
  notes_.push_back("poses: tf of " + sensor + " in " + fixed_frame_ + (why.empty() ? "" : " (" + why + ")"));
}

void BagRecording::choose_pose_topic(const TopicContents& topic, const BagOptions& options) {
  pose_topic_ = &topic;
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
  const auto [bad, frame] = pose_topic_ ? std::pair(pose_topic_->poses.left_out(), pose_topic_->topic.name)
                                        : index_.tree.left_out();
  if (bad == 0) return;
  notes_.push_back("poses: " + count_of(bad, "sample") +
                   " left out, not finite or with a quaternion farther " + "than 1 % from length 1 (" +
                   (pose_topic_ ? "on " : "the first of frame ") + frame + "); poses there are interpolated");
}

SensorKind BagRecording::sensor(std::size_t scan) const {
  return is_cloud(index_.topics[scans_[scan].topic]) ? SensorKind::lidar : SensorKind::depth_camera;
}

std::string BagRecording::name_of(const ListedMessage& scan) const {
  std::array<char, 48> time{};
  std::snprintf(time.data(), time.size(), "%lld.%09lld", static_cast<long long>(scan.stamp_ns / 1000000000),
                static_cast<long long>(std::abs(scan.stamp_ns % 1000000000)));
  return files_[scan.place.file].string() + " " + index_.topics[scan.topic].topic.name + " at " + time.data();
}

Eigen::Isometry3d BagRecording::pose_on_topic(std::int64_t stamp_ns) const {
  try {
    return pose_topic_->poses.at(stamp_ns, gap_ns_).T_parent_child;
  } catch (const NoPose& none) {
    throw NoPose("no pose on " + pose_topic_->topic.name + " at its time: " + none.what());
  }
}

Eigen::Isometry3d BagRecording::pose(const std::string& frame, std::int64_t stamp_ns) const {
  if (!pose_topic_)
    return index_.tree.lookup(fixed_frame_, robot_.empty() ? frame : robot_, stamp_ns, gap_ns_);
  const Eigen::Isometry3d T = pose_on_topic(stamp_ns);
  if (!robot_.empty() || pose_child_.empty() || pose_child_ == frame) return T;
  return T * index_.tree.lookup(pose_child_, frame, stamp_ns, gap_ns_);
}

void BagRecording::read_image(std::string_view bytes, const ListedMessage& listed, Scan& scan) const {
  const TopicContents& topic = index_.topics[listed.topic];
  const Camera& camera = cameras_.at(listed.topic);
  const auto check_size = [&](int width, int height) {
    if (camera.width) require_size(width, height, *camera.width, *camera.height);
    require_same_size(camera.intrinsics, width, height, scan.name);
  };
  const auto reader = message_reader(bytes, topic.topic.encoding);
  if (topic.topic.type == "sensor_msgs/CompressedImage") {
    const DepthImage image =
        depth_of(read_compressed_image_message(*reader), scan.name, largest_scan(bytes_));
    check_size(image.width, image.height);
    scan.points = back_project(image, camera.intrinsics, depth_scale_.value_or(image.default_scale()), none_);
    return;
  }
  const ImageMessage image = read_image_message(*reader);
  check_size(image.width, image.height);
  scan.points = points_of(image, camera.intrinsics, depth_scale_, largest_scan(bytes_), none_);
}

bool BagRecording::holds_clouds(std::size_t scan) const {
  return is_cloud(index_.topics[scans_[scan].topic]);
}

Eigen::Isometry3d BagRecording::pose_at(std::size_t scan, double stamp_s) const {
  return pose(index_.frames[scans_[scan].frame], std::llround(stamp_s * 1e9));
}

Eigen::Isometry3d BagRecording::sensor_in(const std::string& frame, std::size_t scan) const {
  const ListedMessage& listed = scans_[scan];
  return index_.tree.lookup(frame, robot_.empty() ? index_.frames[listed.frame] : robot_, listed.stamp_ns,
                            gap_ns_);
}

RawScan BagRecording::read(std::size_t index, Eigen::Vector3d& shift) {
  const ListedMessage& listed = scans_[index];
  const TopicContents& topic = index_.topics[listed.topic];
  RawScan raw;
  Scan& scan = raw.scan;
  scan.name = name_of(listed);
  scan.sensor = sensor(index);
  try {
    const std::string_view bytes = bag_->read(listed.place);
    if (is_cloud(topic)) {
      const auto reader = message_reader(bytes, topic.topic.encoding);
      CloudMessage cloud = is_livox_type(topic.topic.type)
                               ? read_livox_message(*reader, largest_scan(bytes_))
                               : read_cloud_message(*reader, largest_scan(bytes_));
      if (cloud.organised) scan.sensor = SensorKind::depth_camera;  // if its rays do not tell
      scan.points = std::move(cloud.points);
      shift = cloud.shift;
      raw.times = std::move(cloud.times);
    } else {
      read_image(bytes, listed, scan);
    }
    if (posed_) scan.T_map_sensor = pose(index_.frames[listed.frame], listed.stamp_ns);
    if (!robot_.empty()) {
      const Eigen::Isometry3d T_cloud_robot =
          pose_topic_ ? scan.T_map_sensor
                      : index_.tree.lookup(index_.frames[listed.frame], robot_, listed.stamp_ns, gap_ns_);
      const Eigen::Isometry3d T_robot_cloud = T_cloud_robot.inverse();
      for (Eigen::Vector3f& point : scan.points)
        point = (T_robot_cloud * (point.cast<double>() + shift)).cast<float>();
      shift.setZero();
    }
  } catch (const NoPose& none) {
    throw Error(Error::Kind::data, scan.name, none.what(),
                "--skip-bad leaves such scans out, --max-pose-gap allows more");
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Error(Error::Kind::data, scan.name, error.what(), "--skip-bad leaves it out");
  }
  return raw;
}

}  // namespace octosurf::io
