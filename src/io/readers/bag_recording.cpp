// How a bag's scans are read and posed; bag_choice.cpp chooses what is read.
#include "io/readers/bag_recording.hpp"

#include "io/readers/bounded_file.hpp"

#include <stdexcept>

#include <octosurf/error.hpp>

namespace octosurf::io {

std::vector<RecordedSensor> BagRecording::sensors() const {
  std::vector<RecordedSensor> sensors;
  for (const TopicContents& contents : index_.topics) {
    const bool clouds = is_cloud_type(contents.topic.type);
    const bool lidar =
        clouds && (contents.scans.empty() ||
                   sensor_of_frame(index_.frames[contents.scans.front().frame]) == SensorKind::lidar);
    // Of clouds in the map's frame the motion is undone.
    sensors.push_back({contents.topic.name, !clouds, clouds && robot_.empty(),
                       lidar ? SensorKind::lidar : SensorKind::depth_camera});
  }
  return sensors;
}

std::string BagRecording::name_of(const ListedMessage& scan) const {
  return files_[scan.place.file].string() + " " + index_.topics[scan.topic].topic.name + " at " +
         stamp_text(scan.header_ns);
}

Eigen::Isometry3d BagRecording::pose_on_topic(std::int64_t stamp_ns) const {
  try {
    return pose_topic_->poses.at(stamp_ns, largest_gap_in_bags_ns);
  } catch (const NoPose& none) {
    throw NoPose("no pose on " + pose_topic_->topic.name + " at its time: " + none.what());
  }
}

Eigen::Isometry3d BagRecording::pose(const std::string& frame, std::int64_t stamp_ns) const {
  if (!pose_topic_)
    return tree_.lookup(fixed_frame_, robot_.empty() ? frame : robot_, stamp_ns, largest_gap_in_bags_ns);
  const Eigen::Isometry3d T = pose_on_topic(stamp_ns);
  if (!robot_.empty() || pose_child_.empty() || pose_child_ == frame) return T;
  return T * tree_.lookup(pose_child_, frame, stamp_ns, largest_gap_in_bags_ns);
}

/// By the last message before the image, or else the first, of those for its size.
std::pair<Intrinsics, const Lens*> BagRecording::camera_of(const ListedMessage& listed, int width, int height,
                                                           const std::string& where) const {
  const Camera& camera = cameras_.at(listed.topic);
  if (camera.info == nullptr) {
    require_same_size(camera.given, width, height, where);
    return {camera.given, nullptr};
  }
  std::optional<Intrinsics> found;
  const CameraInfoMessage* of = nullptr;
  std::string why_not;
  for (const ListedCamera& info : camera.info->cameras) {
    if (found && info.stamp_ns > listed.stamp_ns) break;
    try {
      found = intrinsics_for(info.camera, camera.rectified, width, height);
      of = &info.camera;
    } catch (const std::runtime_error& error) {
      why_not = error.what();
    }
  }
  if (!found) fail_reading(why_not);
  if (of->columns == 0) require_same_size(*found, width, height, where);
  return {*found, lens_of(*of, camera.rectified)};
}

Eigen::Isometry3d BagRecording::pose_at(std::size_t scan, double stamp_s) const {
  return pose(index_.frames[scans_[scan].frame], to_ns(stamp_s));
}

Eigen::Isometry3d BagRecording::sensor_in(const std::string& frame, std::size_t scan) const {
  const ListedMessage& listed = scans_[scan];
  return tree_.lookup(frame, robot_.empty() ? index_.frames[listed.frame] : robot_, listed.stamp_ns,
                      largest_gap_in_bags_ns);
}

RawScan BagRecording::read(std::size_t index) {
  const ListedMessage& listed = scans_[index];
  const TopicContents& topic = index_.topics[listed.topic];
  RawScan raw;
  Scan& scan = raw.scan;
  scan.name = name_of(listed);
  try {
    const auto reader = message_reader(bag_->read(listed.place), topic.topic.encoding);
    if (is_cloud_type(topic.topic.type)) {
      Cloud cloud = read_cloud_message(*reader, largest_scan(bytes_), topic.topic.type);
      scan.points = std::move(cloud.points);
      raw.shift = cloud.shift;
      raw.times = std::move(cloud.times);
      raw.times.later_s = static_cast<double>(listed.stamp_ns - listed.header_ns) / 1e9;
    } else {
      const auto unit = units_.find(listed.topic);
      scan.points = read_depth_message(
          *reader, topic.topic.type, depth_scale_ || unit == units_.end() ? depth_scale_ : unit->second,
          scan.name, largest_scan(bytes_),
          [&](int width, int height) { return camera_of(listed, width, height, scan.name); });
    }
    if (posed_) scan.T_map_sensor = pose(index_.frames[listed.frame], listed.stamp_ns);
    if (!robot_.empty()) {
      const Eigen::Isometry3d T_cloud_robot =
          pose_topic_ ? scan.T_map_sensor : sensor_in(index_.frames[listed.frame], index);
      const Eigen::Isometry3d T_robot_cloud = T_cloud_robot.inverse();
      for (Eigen::Vector3f& point : scan.points)
        point = (T_robot_cloud * (point.cast<double>() + raw.shift)).cast<float>();
      raw.shift.setZero();
    }
  } catch (const NotInTf& none) {
    throw Error(Error::Kind::data, scan.name, none.what(),
                "--pose-frame names whose poses a topic has (" + index_.frames[listed.frame] +
                    ": the scans' own); if clouds lie in the poses' frame, --pose-form in-map");
  } catch (const NoPose& none) {
    throw Error(Error::Kind::data, scan.name, none.what(), "--skip-bad leaves such scans out");
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Error(Error::Kind::data, scan.name, error.what(), "--skip-bad leaves it out");
  }
  return raw;
}

}  // namespace octosurf::io
