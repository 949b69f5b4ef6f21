#include "io/readers/recorded_scan.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/readers/depth_image.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

using Scans = std::vector<const ListedScan*>;

RawScan read_file(const ListedRecording& recording, const ListedScan& listed) {
  RawScan raw;
  Scan& scan = raw.scan;
  scan.name = listed.file.string();
  if (listed.kind == FileKind::image) {
    const DepthImage image = read_depth_image(listed.file);
    require_same_size(*recording.camera, image.width, image.height, scan.name);
    scan.points = back_project(image, *recording.camera, recording.depth_scale);
    raw.width = image.width;
    raw.height = image.height;
    return raw;
  }
  Cloud cloud = with_place(
      [&] {
        if (listed.kind == FileKind::pcd) return read_pcd(listed.file);
        if (listed.kind == FileKind::ply) return read_ply(listed.file);
        return read_velodyne(listed.file);
      },
      [&](const std::string& what) { return Error(Error::Kind::data, scan.name, what); });
  scan.points = std::move(cloud.points);
  scan.T_map_sensor = cloud.T_map_sensor;
  raw.shift = cloud.shift;
  raw.times = std::move(cloud.times);
  return raw;
}

Eigen::Isometry3d own_pose(const ListedScan& listed) {
  const PoseFile file = read_poses(listed.pose_file);
  if (file.poses.size() != 1)
    throw Error(Error::Kind::data, listed.pose_file.string(),
                std::to_string(file.poses.size()) + " poses for one scan");
  return rigid(file.poses[0].T, file.poses[0].where);
}

/// Of the scans' sensor; throws NoPose where there is none.
Eigen::Isometry3d pose_at(const ListedRecording& recording, const Scans& scans, double stamp_s) {
  if (recording.trajectory)
    return recording.sensor_at(recording.trajectory->at(to_ns(stamp_s), largest_pose_gap_ns));
  if (!scans.front()->pose) return recording.sensor_at(recording.bag->pose_at(scans.front()->index, stamp_s));
  const auto scan =
      std::ranges::lower_bound(scans, stamp_s, {}, [](const auto* listed) { return *listed->stamp_s; });
  if (scan == scans.end() || *(*scan)->stamp_s != stamp_s) throw NoPose("no pose between scans");
  return recording.sensor_at(rigid((*scan)->pose->T, (*scan)->pose->where));
}

}  // namespace

std::optional<Eigen::Vector3d> far_origin(const ScanList& list, const ScanSourceOptions& options) {
  for (const ListedRecording& recording : list.recordings) {
    try {
      const RawScan first = read_posed(recording, recording.scans.front(), options);
      const Eigen::Vector3d place =
          first.from_nowhere() ? first.shift : first.scan.T_map_sensor.translation();
      if (!(place.lpNorm<Eigen::Infinity>() > options.origin_beyond_m)) return {};
      Eigen::Vector3d origin = place.array().round();
      if (!first.from_nowhere()) origin.z() -= 1;  // m: a scan at 0 would be taken for one without a pose
      return origin;
    } catch (const Error&) {  // reported when its turn comes
    }
  }
  return {};
}

RawScan read_posed(const ListedRecording& recording, const ListedScan& listed,
                   const ScanSourceOptions& options) {
  RawScan raw = recording.bag     ? recording.bag->read(listed.index)
                : recording.graph ? RawScan{recording.graph->read(listed.index)}
                                  : read_file(recording, listed);
  Scan& scan = raw.scan;
  const RecordedSensor& sensor = recording.sensors[listed.sensor];
  scan.sensor = sensor.kind;
  if (options.depth_scale && !sensor.images) {
    for (Eigen::Vector3f& point : scan.points) point /= static_cast<float>(*options.depth_scale);
    raw.shift /= *options.depth_scale;
    if (!recording.bag) scan.T_map_sensor.translation() /= *options.depth_scale;  // of the same file
  }
  if (recording.trajectory)
    scan.T_map_sensor = recording.trajectory->at(to_ns(*listed.stamp_s), largest_pose_gap_ns);
  else if (listed.pose)
    scan.T_map_sensor = rigid(listed.pose->T, scan.name + " (pose at " + listed.pose->where + ")");
  else if (!listed.pose_file.empty())
    scan.T_map_sensor = own_pose(listed);
  else if (!recording.bag)  // made of rigid ones
    scan.T_map_sensor = rigid(scan.T_map_sensor, scan.name);
  raw.posed = recording.trajectory || listed.pose || !listed.pose_file.empty() || recording.bag ||
              recording.graph || scan.T_map_sensor.matrix() != Eigen::Isometry3d::Identity().matrix();
  if (raw.posed) scan.T_map_sensor = recording.sensor_at(scan.T_map_sensor);
  if (recording.pose_form == PoseForm::in_map && !raw.shifted()) {  // else place() moves its points
    const Eigen::Isometry3d T_sensor_map = scan.T_map_sensor.inverse();
    for (Eigen::Vector3f& point : scan.points) point = (T_sensor_map * point.cast<double>()).cast<float>();
  }
  return raw;
}

void require_size_as_before(const RawScan& raw, std::optional<std::pair<int, int>>& before) {
  if (raw.width == 0) return;
  if (!before) before = {raw.width, raw.height};
  if (std::pair(raw.width, raw.height) != *before)
    throw Error(Error::Kind::data, raw.scan.name,
                size_text(raw.width, raw.height) + " pixels, but the images before have " +
                    size_text(before->first, before->second),
                "the images of a recording are of one camera");
}

std::size_t erase_own(Scan& scan, const ListedRecording& recording, const ListedScan& listed,
                      const std::vector<SelfBox>& boxes) {
  return erase_own(scan, boxes, [&](const std::string& frame) {
    if (!recording.bag)
      throw Error(Error::Kind::usage, "--self-box " + frame,
                  "names a frame, and " + recording.sensors[listed.sensor].name + " has no tf",
                  "give the box in the sensor's frame, X Y Z X Y Z alone");
    try {
      return recording.bag->sensor_in(frame, listed.index);
    } catch (const NoPose& no_pose) {
      throw Error(
          Error::Kind::data, scan.name, std::string("--self-box ") + frame + ": " + no_pose.what(),
          "name a frame that tf has, or none: the scans' own; --skip-bad leaves out scans without a pose");
    }
  });
}

Motions motions_of(const ListedRecording& recording, const ScanSourceOptions& options,
                   std::vector<std::string>& notes) {
  std::map<std::uint32_t, Scans> sensors;
  if (recording.pose_form == PoseForm::in_map) return {};  // whoever moved its points has undone it
  for (const ListedScan& listed : recording.scans)
    if (recording.sensors[listed.sensor].moves_within) sensors[listed.sensor].push_back(&listed);
  Motions motions;
  for (const auto& [sensor, scans] : sensors) {
    ScanMotion::Recording timed;
    for (const ListedScan* listed : scans)
      if (listed->stamp_s) timed.stamps_s.push_back(*listed->stamp_s);
    const Scans all = scans;
    timed.read = [&recording, all, options](std::size_t i) {
      return read_posed(recording, *all[i], options);
    };
    const bool posed = recording.trajectory || recording.bag || scans.front()->pose;
    if (!posed || timed.stamps_s.size() != scans.size()) continue;
    timed.pose_at = [&recording, all](double stamp_s) { return pose_at(recording, all, stamp_s); };
    const ScanMotion& motion = motions.emplace(sensor, ScanMotion(std::move(timed))).first->second;
    for (const std::string& note : motion.notes())
      notes.push_back((recording.bag ? scans.front()->file : recording.folder).string() + ": " + note);
  }
  return motions;
}

void set_viewpoint(RawScan& raw, const Eigen::Vector3d& at) {
  raw.posed = true;
  raw.scan.T_map_sensor.translation() = at;
  if (raw.shifted()) return;  // place() moves its points
  for (Eigen::Vector3f& point : raw.scan.points) point -= at.cast<float>();
}

Scan place(RawScan raw, const Eigen::Vector3d& origin) {
  Scan& scan = raw.scan;
  Eigen::Isometry3d& T = scan.T_map_sensor;
  if (raw.from_nowhere()) {
    const Eigen::Vector3f rest = (raw.shift - origin).cast<float>();
    for (Eigen::Vector3f& point : scan.points) point += rest;
    return std::move(scan);
  }
  if (raw.shifted()) {
    const Eigen::Vector3d rest = raw.shift - T.translation();
    if (rest.lpNorm<Eigen::Infinity>() > farthest_m)
      throw Error(
          Error::Kind::data, scan.name,
          "its points lie about " + text_of(raw.shift) + " m, its pose at " + text_of(T.translation()),
          "give clouds in the sensor's frame, or poses in the clouds'");
    const Eigen::Matrix3d R_sensor_map = T.linear().transpose();
    for (Eigen::Vector3f& point : scan.points)
      point = (R_sensor_map * (point.cast<double>() + rest)).cast<float>();
  }
  T.translation() -= origin;
  return std::move(scan);
}

double StampSequence::next(const std::optional<double>& stamp_s, double rate_hz) {
  double now = rate_ > 0 ? since_s_ + static_cast<double>(steps_) / rate_ : 0;
  if (stamp_s) {
    if (!shift_s_) shift_s_ = rate_ > 0 ? std::max(0.0, now - *stamp_s) : 0.0;
    now = *stamp_s + *shift_s_;
  }
  if (stamp_s || rate_hz != rate_) {
    since_s_ = now;
    steps_ = 0;
    rate_ = rate_hz;
  }
  ++steps_;
  return now;
}

}  // namespace octosurf::io
