#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/readers/depth_image.hpp"
#include "io/readers/file_kind.hpp"
#include "io/readers/reading_rules.hpp"
#include "io/readers/scan_list.hpp"
#include "io/readers/scan_motion.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace fs = std::filesystem;

namespace io {
namespace {

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

}  // namespace

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

namespace {

/// Throws Error(data) if it is an image of another size than `before`, which the first one sets.
void require_size_as_before(const RawScan& raw, std::optional<std::pair<int, int>>& before) {
  if (raw.width == 0) return;
  if (!before) before = {raw.width, raw.height};
  if (std::pair(raw.width, raw.height) != *before)
    throw Error(Error::Kind::data, raw.scan.name,
                size_text(raw.width, raw.height) + " pixels, but the images before have " +
                    size_text(before->first, before->second),
                "the images of a recording are of one camera");
}

/// Readings in the boxes become NaN; returns their number. Throws Error(usage) where a box names a frame
/// without tf.
std::size_t erase_own(Scan& scan, const ListedRecording& recording, const ListedScan& listed,
                      const std::vector<SelfBox>& boxes) {
  return io::erase_own(scan, boxes, [&](const std::string& frame) {
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

using Scans = std::vector<const ListedScan*>;

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

using Motions = std::map<std::uint32_t, ScanMotion>;  // by sensor

/// Of the sensors whose points may have times, where their poses are known then. Keeps a reference to the
/// recording.
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

/// Seen from a place of its frame, a scan without a pose.
void set_viewpoint(RawScan& raw, const Eigen::Vector3d& at) {
  raw.posed = true;
  raw.scan.T_map_sensor.translation() = at;
  if (raw.shifted()) return;  // place() moves its points
  for (Eigen::Vector3f& point : raw.scan.points) point -= at.cast<float>();
}

/// Gives the points their place in the sensor's frame, and subtracts the origin from the pose; a survey's
/// points, which have no sensor's place, stay in the map's frame. Throws Error(data) if points and pose are
/// too far apart for that.
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

/// The scans of all inputs in one order, each with its pose, time stamp and kind of sensor; read on demand.
class Recording : public ScanSource {
 public:
  /// Lists the scans, chooses what the options leave open (notes()), and reads the first of each sensor.
  Recording(const std::vector<fs::path>& inputs, const ScanSourceOptions& options)
      : options_(options), list_(list_scans(inputs, options)), size_of_(list_.recordings.size()) {
    choose_origin();
    for (const ListedRecording& recording : list_.recordings)
      motions_.push_back(motions_of(recording, options_, list_.notes));
    stamp_all();
  }

  std::size_t size() const override { return scans_.size(); }
  const std::vector<std::string>& skipped() const override { return list_.left_out; }
  Eigen::Vector3d origin() const override { return origin_; }

  std::vector<std::string> notes() const override { return list_.notes; }

  SensorKind sensor() const override {
    const bool camera = std::ranges::any_of(scans_, [&](const Place& place) {
      const ListedRecording& recording = list_.recordings[place.recording];
      return recording.sensors[recording.scans[place.scan].sensor].kind == SensorKind::depth_camera;
    });
    return camera ? SensorKind::depth_camera : SensorKind::lidar;
  }

  std::optional<Scan> next() override {
    while (at_ < size()) {
      try {
        Scan scan = read(scans_[at_++]);
        ++good_;
        return scan;
      } catch (const Error& error) {
        if (!options_.skip_bad || error.kind() != Error::Kind::data) throw;
        list_.left_out.push_back(error.what());
      }
    }
    if (options_.skip_bad && std::exchange(good_, 1) == 0)
      throw Error(Error::Kind::data, "", "none of the " + std::to_string(size()) + " scans is good",
                  "the last one: " + list_.left_out.back());
    return std::nullopt;
  }

  bool skip(std::size_t count) override {
    if (options_.skip_bad) return ScanSource::skip(count);
    const bool enough = count <= size() - at_;
    at_ = enough ? at_ + count : size();
    return enough;
  }

 private:
  struct Place {
    std::size_t recording, scan;
    double stamp_s;
  };

  /// Near the first good scan, if that is too far from 0; in whole metres.
  void choose_origin() {
    if (options_.origin) {
      origin_ = *options_.origin;
      return;
    }
    for (const ListedRecording& recording : list_.recordings) {
      try {
        const RawScan first = read_posed(recording, recording.scans.front(), options_);
        const Eigen::Vector3d place =
            first.from_nowhere() ? first.shift : first.scan.T_map_sensor.translation();
        if (!(place.lpNorm<Eigen::Infinity>() > options_.origin_beyond_m)) return;
        origin_ = place.array().round();
        if (!first.from_nowhere()) origin_.z() -= 1;  // m: a scan at 0 would be taken for one without a pose
        list_.notes.push_back("origin: " + text_of(origin_) +
                              " m is subtracted from all coordinates, which are too far from 0 for an "
                              "octree; --origin X Y Z states another");
        return;
      } catch (const Error&) {  // reported when its turn comes
      }
    }
  }

  /// A recording's stamps are used unless they would decrease where it begins. A scan without one follows the
  /// one before it at its sensor's rate.
  void stamp_all() {
    double since_s = 0, rate_hz = 0;  // rate 0: no scan yet
    std::size_t steps = 0;            // since since_s; a count, so that rounding does not accumulate
    for (std::size_t r = 0; r < list_.recordings.size(); ++r) {
      const ListedRecording& recording = list_.recordings[r];
      std::optional<double> shift_s;  // of this recording's time stamps
      for (std::size_t i = 0; i < recording.scans.size(); ++i) {
        const ListedScan& listed = recording.scans[i];
        const bool lidar = recording.sensors[listed.sensor].kind == SensorKind::lidar;
        const double usual_hz = lidar ? 10 : 30;
        double now_s = rate_hz > 0 ? since_s + static_cast<double>(steps) / rate_hz : 0;
        if (listed.stamp_s) {
          if (!shift_s) shift_s = rate_hz > 0 ? std::max(0.0, now_s - *listed.stamp_s) : 0.0;
          now_s = *listed.stamp_s + *shift_s;
        }
        if (listed.stamp_s || usual_hz != rate_hz) {
          since_s = now_s;
          steps = 0;
          rate_hz = usual_hz;
        }
        ++steps;
        scans_.push_back({r, i, now_s});
      }
    }
  }

  /// In the map's frame. Motion is undone before an origin is subtracted; a survey's points are in the map's
  /// frame and have none.
  Scan read(const Place& at) {
    const ListedRecording& recording = list_.recordings[at.recording];
    const ListedScan& listed = recording.scans[at.scan];
    const RecordedSensor& sensor = recording.sensors[listed.sensor];
    RawScan raw = read_posed(recording, listed, options_);
    require_size_as_before(raw, size_of_[at.recording]);
    const std::size_t own = erase_own(raw.scan, recording, listed, options_.self_boxes);
    if (own > 0 && !std::exchange(own_noted_, true))
      list_.notes.push_back("self-box: " + std::to_string(own) + " of the " +
                            std::to_string(raw.scan.points.size()) + " readings of " + raw.scan.name +
                            " are the robot's own");
    drop_no_returns(raw.scan, sensor.images, options_);
    const Motions& motions = motions_[at.recording];
    if (const auto motion = motions.find(listed.sensor); motion != motions.end() && !raw.shifted()) {
      raw.scan.stamp_s = *listed.stamp_s;
      raw.scan = motion->second({std::move(raw.scan), std::move(raw.times)});
    }
    look_from(raw, sensor.images);
    Scan scan = place(std::move(raw), origin_);
    scan.stamp_s = at.stamp_s;
    return scan;
  }

  /// Gives a cloud without a pose the viewpoint that is stated, or the default.
  void look_from(RawScan& raw, bool image) {
    if (options_.viewpoint) {
      if (raw.posed)
        throw Error(Error::Kind::usage, "--viewpoint", raw.scan.name + " has a pose already",
                    "give it with clouds that have none");
      return set_viewpoint(raw, *options_.viewpoint);
    }
    if (raw.posed || image || size() > 1) return;
    const auto found = likely_viewpoint(raw.scan);
    if (!found) return;
    const Eigen::Vector3d at = raw.shift + found->at;
    list_.notes.push_back(
        raw.scan.name +
        formatted(" does not say where it was seen from; from the origin %.0f %% of its readings would lie "
                  "behind others, from above %.0f %%: taken as seen from ",
                  100 * found->hidden_origin, 100 * found->hidden) +
        text_of(at) + "; --viewpoint X Y Z says where it was");
    set_viewpoint(raw, at);
  }

  ScanSourceOptions options_;
  ScanList list_;
  std::vector<Motions> motions_;                             // of each recording
  std::vector<std::optional<std::pair<int, int>>> size_of_;  // of each recording's images
  std::vector<Place> scans_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  bool own_noted_ = false;
  std::size_t at_ = 0, good_ = 0;
};

}  // namespace
}  // namespace io

bool is_occupancy_map(const fs::path& input) {
  std::error_code error;
  const auto status = fs::status(input, error);
  if (!fs::exists(status)) {
    if (fs::exists(fs::path(input) += ".surfaces", error))
      throw Error(Error::Kind::data, input.string(), "a saved map, not scans", "resume it by --resume");
    throw Error(Error::Kind::data, input.string(), "no such file or folder");
  }
  if (fs::is_directory(status)) return false;
  const io::FileKind kind = fs::is_regular_file(status) ? io::kind_of(input) : io::FileKind::unknown;
  if (input.extension() == ".surfaces")
    throw Error(Error::Kind::data, input.string(), "a saved map, not scans", "resume it by --resume");
  if (kind != io::FileKind::unknown) return kind == io::FileKind::occupancy_map;
  io::files_of_bag(input);  // throws for a compressed one
  throw Error(Error::Kind::data, input.string(), "not a kind of file that is read",
              "give depth images (PNG, PGM), clouds (PCD, PLY, velodyne .bin), a bag (.bag, .db3, .mcap), a "
              ".graph, .bt or .ot");
}

std::unique_ptr<ScanSource> open_scans(const std::vector<fs::path>& inputs,
                                       const ScanSourceOptions& options) try {
  return std::make_unique<io::Recording>(inputs, options);
} catch (const fs::filesystem_error& error) {
  throw Error(Error::Kind::data, error.path1().string(), error.code().message());
}

}  // namespace octosurf
