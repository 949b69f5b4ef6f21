#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"
#include "io/readers/depth_image.hpp"
#include "io/readers/file_kind.hpp"
#include "io/readers/reading_rules.hpp"
#include "io/readers/scan_list.hpp"
#include "io/readers/scan_motion.hpp"
#include "io/readers/self_boxes.hpp"
#include "io/readers/transform_tree.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

/// Reads listed scans and gives them their time stamps.
class FileScanSource : public ScanSource {
 public:
  FileScanSource(io::ScanList list, const ScanSourceOptions& options)
      : recordings_(std::move(list.recordings)),
        options_(options),
        rules_(options),
        skipped_(std::move(list.left_out)),
        notes_(std::move(list.notes)) {
    for (const auto& recording : recordings_) size_ += recording.scans.size();
    if (options_.origin)
      origin_ = *options_.origin;
    else
      choose_origin();
    for (const auto& recording : recordings_) motions_.push_back(motions_of(recording));
    for (const auto& recording : recordings_) meet_sensors(recording);
  }

  std::size_t size() const override { return size_; }
  const std::vector<std::string>& skipped() const override { return skipped_; }
  Eigen::Vector3d origin() const override { return origin_; }
  std::vector<std::string> notes() const override {
    std::vector<std::string> all = notes_;
    all.insert(all.end(), rules_.notes().begin(), rules_.notes().end());
    return all;
  }

  std::optional<Scan> next() override {
    while (const io::ListedScan* const following = advance()) {
      const io::ListedRecording& recording = recordings_[recording_];
      const io::ListedScan& listed = *following;
      try {
        Scan scan = load(recording, motions_[recording_], listed);
        scan.stamp_s = stamp(listed, scan.sensor);
        ++good_;
        return scan;
      } catch (const Error& error) {
        stamp(listed, sensor_of(recording, listed));
        if (!options_.skip_bad || error.kind() != Error::Kind::data) throw;
        skipped_.push_back(error.what());
      }
    }
    if (options_.skip_bad && std::exchange(good_, 1) == 0)
      throw Error(Error::Kind::data, "", "none of the " + std::to_string(size_) + " scans is good",
                  "the last one: " + skipped_.back());
    return std::nullopt;
  }

  bool skip(std::size_t count) override {
    if (options_.skip_bad) return ScanSource::skip(count);
    for (; count > 0; --count) {
      const io::ListedScan* const listed = advance();
      if (listed == nullptr) return false;
      stamp(*listed, sensor_of(recordings_[recording_], *listed));
      first_.reset();
    }
    return true;
  }

 private:
  /// The next scan of all recordings, null at the end.
  const io::ListedScan* advance() {
    while (recording_ < recordings_.size() && index_ == recordings_[recording_].scans.size())
      begin_recording(recording_ + 1);
    return recording_ < recordings_.size() ? &recordings_[recording_].scans[index_++] : nullptr;
  }

  void begin_recording(std::size_t recording) {
    recording_ = recording;
    index_ = 0;
    image_width_ = image_height_ = 0;
    shift_s_.reset();
  }

  /// Looks at the first scans, so that the kinds of their sensors are known before the run. Bad ones are
  /// reported when their turn comes.
  void meet_sensors(const io::ListedRecording& recording) {
    constexpr std::size_t looked_at = 20;
    for (std::size_t i = 0; i < std::min(looked_at, recording.scans.size()); ++i) {
      const io::ListedScan& listed = recording.scans[i];
      if (rules_.knows(sensor_id(recording, listed))) continue;
      try {
        Scan scan =
            load(recording, motions_[static_cast<std::size_t>(&recording - recordings_.data())], listed);
        // Not an image: their sizes are compared as they are read.
        if (&listed == recordings_.front().scans.data() && !is_image(recording, listed))
          first_ = std::move(scan);
      } catch (const Error& error) {
        if (error.kind() == Error::Kind::usage) throw;
      }
    }
    image_width_ = image_height_ = 0;
  }

  io::ReadingRules::Sensor sensor_id(const io::ListedRecording& recording,
                                     const io::ListedScan& listed) const {
    return {static_cast<std::size_t>(&recording - recordings_.data()), sensor_index(recording, listed)};
  }

  static bool is_image(const io::ListedRecording& recording, const io::ListedScan& listed) {
    return recording.bag ? recording.bag->sensor(listed.index) == SensorKind::depth_camera
                         : listed.kind == io::FileKind::image;
  }

  /// Near the first good scan, if that is far away.
  void choose_origin() {
    for (const io::ListedRecording& recording : recordings_) {
      try {
        const Survey first = posed(recording, recording.scans.front());
        const Eigen::Vector3d place =
            first.from_nowhere() ? first.shift : first.scan.T_map_sensor.translation();
        if (!(place.lpNorm<Eigen::Infinity>() > options_.origin_beyond_m)) return;
        origin_ = place.array().round();
        if (!first.from_nowhere()) origin_.z() -= 1;  // m: a scan at 0 would be taken for one without a pose
        notes_.push_back("origin: " + io::text_of(origin_) +
                         " m is subtracted from all coordinates, which are too far from 0 for an octree; "
                         "--origin X Y Z states another");
        return;
      } catch (const Error&) {  // next() reports it
      }
    }
  }

  /// A posed scan whose points may lack a shift. That of a survey's points, in the map's frame, is far away.
  struct Survey {
    Scan scan;
    io::PointTimes times{};
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    bool shifted() const { return !shift.isZero(0); }
    bool from_nowhere() const {
      return shifted() && scan.T_map_sensor.matrix() == Eigen::Isometry3d::Identity().matrix();
    }
  };

  using Motions = std::map<std::uint32_t, io::ScanMotion>;  // by sensor
  using Scans = std::vector<const io::ListedScan*>;

  /// A bag's topics may be of several sensors, files are of one.
  static std::uint32_t sensor_index(const io::ListedRecording& recording, const io::ListedScan& listed) {
    return recording.bag ? recording.bag->topic(listed.index) : 0;
  }

  Motions motions_of(const io::ListedRecording& recording) {
    std::map<std::uint32_t, Scans> sensors;
    for (const io::ListedScan& listed : recording.scans) {
      const bool cloud = recording.bag
                             ? recording.bag->holds_clouds(listed.index) && !recording.bag->registered()
                             : listed.kind == io::FileKind::pcd || listed.kind == io::FileKind::ply;
      if (cloud) sensors[sensor_index(recording, listed)].push_back(&listed);
    }
    Motions motions;
    for (const auto& [sensor, scans] : sensors) {
      io::ScanMotion::Recording timed;
      for (const io::ListedScan* listed : scans)
        if (listed->stamp_s) timed.stamps_s.push_back(*listed->stamp_s);
      const Scans all = scans;
      timed.read = [this, &recording, all](std::size_t i) {
        Survey survey = read(recording, *all[i]);
        return io::RawScan{std::move(survey.scan), std::move(survey.times)};
      };
      const bool posed = recording.trajectory || recording.bag || scans.front()->pose;
      if (!posed || timed.stamps_s.size() != scans.size()) {
        note_unused_times(timed, scans.size());
        continue;
      }
      timed.pose_at = [&recording, all](double stamp_s) { return pose_at(recording, all, stamp_s); };
      timed.undo = options_.deskew == Deskew::automatic;
      timed.real = recording.bag != nullptr;
      const io::ScanMotion& motion = motions.emplace(sensor, io::ScanMotion(std::move(timed))).first->second;
      for (const std::string& note : motion.notes())
        notes_.push_back((recording.bag ? scans.front()->file : recording.folder).string() + ": " + note);
    }
    return motions;
  }

  void note_unused_times(const io::ScanMotion::Recording& timed, std::size_t scans) {
    if (scans < 2 || options_.deskew != Deskew::automatic) return;
    try {
      const io::RawScan first = timed.read(0);
      const auto cloud = io::timed_cloud(0, first.scan.points, first.times);
      if (cloud && cloud->first < cloud->last)
        notes_.push_back(first.scan.name + ": times: field " + first.times.field +
                         " is not used: motion within scans is undone where these have time stamps and poses "
                         "(files that are called like times, --poses FILE)");
    } catch (const Error&) {  // reported when its turn comes
    }
  }

  /// Of the scans' sensor; throws NoPose where there is none.
  static Eigen::Isometry3d pose_at(const io::ListedRecording& recording, const Scans& scans, double stamp_s) {
    if (recording.trajectory) {
      if (!recording.trajectory->covers(stamp_s)) throw io::NoPose("no pose at its time");
      return recording.trajectory->at(stamp_s, recording.folder.string()) * recording.T_posed_sensor;
    }
    if (!scans.front()->pose) return recording.bag->pose_at(scans.front()->index, stamp_s);
    const auto scan =
        std::ranges::lower_bound(scans, stamp_s, {}, [](const auto* listed) { return *listed->stamp_s; });
    if (scan == scans.end() || *(*scan)->stamp_s != stamp_s) throw io::NoPose("no pose between scans");
    return io::rigid((*scan)->pose->T, (*scan)->pose->where) * recording.T_posed_sensor;
  }

  /// Motion is undone before an origin is subtracted; points of a survey are in the map's frame and have
  /// none.
  Scan load(const io::ListedRecording& recording, const Motions& motions, const io::ListedScan& listed) {
    if (first_ && &listed == recordings_.front().scans.data()) {
      Scan scan = std::move(*first_);
      first_.reset();
      scan.sensor = rules_.kind(sensor_id(recording, listed)).value_or(scan.sensor);  // if a later one told
      return scan;
    }
    Survey read = posed(recording, listed);
    Scan& scan = read.scan;
    const std::string where =
        recording.bag ? recording.bag->topic_name(listed.index) : recording.folder.string();
    erase_own(recording, listed, scan, where);
    const std::vector<std::size_t> free =
        rules_.apply(scan, sensor_id(recording, listed), is_image(recording, listed), where);
    if (const auto motion = motions.find(sensor_index(recording, listed));
        motion != motions.end() && !read.shifted()) {
      scan.stamp_s = *listed.stamp_s;
      scan = motion->second({std::move(scan), std::move(read.times)});
    }
    io::move_to_free_rays(scan, free);
    Eigen::Isometry3d& T = scan.T_map_sensor;
    if (read.from_nowhere()) {
      const Eigen::Vector3f rest = (read.shift - origin_).cast<float>();
      for (auto* points : {&scan.points, &scan.free_rays})
        for (Eigen::Vector3f& point : *points) point += rest;
      return std::move(scan);
    }
    if (read.shifted()) {
      if ((read.shift - T.translation()).lpNorm<Eigen::Infinity>() > io::farthest_m)
        throw Error(Error::Kind::data, scan.name,
                    "its points lie about " + io::text_of(read.shift) + " m, its pose at " +
                        io::text_of(T.translation()),
                    "give clouds in the sensor's frame, or poses in the clouds'");
      const Eigen::Vector3d rest = read.shift - T.translation();
      const Eigen::Matrix3d R_sensor_map = T.linear().transpose();
      for (Eigen::Vector3f& point : scan.points)
        point = (R_sensor_map * (point.cast<double>() + rest)).cast<float>();
    }
    T.translation() -= origin_;
    return std::move(scan);
  }

  void erase_own(const io::ListedRecording& recording, const io::ListedScan& listed, Scan& scan,
                 const std::string& where) {
    const std::size_t own = io::erase_own(scan, options_.self_boxes, [&](const std::string& frame) {
      if (!recording.bag)
        throw Error(Error::Kind::usage, "--self-box " + frame, "names a frame, and " + where + " has no tf",
                    "give the box in the sensor's frame, X Y Z X Y Z alone");
      try {
        return recording.bag->sensor_in(frame, listed.index);
      } catch (const io::NoPose& none) {
        throw Error(Error::Kind::data, scan.name, std::string("--self-box ") + frame + ": " + none.what(),
                    "--skip-bad leaves such scans out");
      }
    });
    if (own == 0 || std::exchange(own_noted_, true)) return;
    notes_.push_back("self-box: " + std::to_string(own) + " of the " + std::to_string(scan.points.size()) +
                     " readings of " + scan.name + " are the robot's own");
  }

  Survey posed(const io::ListedRecording& recording, const io::ListedScan& listed) {
    Survey read = this->read(recording, listed);
    Scan& scan = read.scan;
    if (options_.cloud_scale && !is_image(recording, listed)) {
      for (Eigen::Vector3f& point : scan.points) point /= static_cast<float>(*options_.cloud_scale);
      read.shift /= *options_.cloud_scale;
      if (!recording.bag) scan.T_map_sensor.translation() /= *options_.cloud_scale;  // of the same file
    }
    if (recording.trajectory)
      scan.T_map_sensor = recording.trajectory->at(*listed.stamp_s, scan.name) * recording.T_posed_sensor;
    else if (listed.pose)
      scan.T_map_sensor = io::rigid(listed.pose->T, scan.name + " (pose at " + listed.pose->where + ")") *
                          recording.T_posed_sensor;
    else if (!listed.pose_file.empty())
      scan.T_map_sensor = own_pose(listed);
    else if (!recording.bag)  // made of rigid ones
      scan.T_map_sensor = io::rigid(scan.T_map_sensor, scan.name);
    return read;
  }

  static io::Cloud read_cloud(const io::ListedRecording& recording, const io::ListedScan& listed) {
    if (listed.kind == io::FileKind::pcd) return io::read_pcd(listed.file);
    if (listed.kind == io::FileKind::ply) return io::read_ply(listed.file);
    return io::read_velodyne(listed.file, recording.floats);
  }

  /// Points, and the pose in the same file.
  Survey read(const io::ListedRecording& recording, const io::ListedScan& listed) {
    if (recording.graph) return {recording.graph->read(listed.index)};
    Survey result;
    Scan& scan = result.scan;
    if (recording.bag) {
      io::RawScan raw = recording.bag->read(listed.index, result.shift);
      scan = std::move(raw.scan);
      result.times = std::move(raw.times);
      return result;
    }
    scan.name = listed.file.string();
    if (listed.kind == io::FileKind::image) {
      const io::DepthImage image = io::read_depth_image(listed.file);
      check_size(image, listed.file);
      io::require_same_size(*recording.camera, image.width, image.height, scan.name);
      scan.points =
          io::back_project(image, *recording.camera, recording.depth_scale,
                           options_.clear_no_return_m > 0 ? io::NoReturn::far : io::NoReturn::left_out);
      return result;
    }
    io::Cloud cloud =
        io::with_place([&] { return read_cloud(recording, listed); },
                       [&](const std::string& what) { return Error(Error::Kind::data, scan.name, what); });
    scan.points = std::move(cloud.points);
    scan.T_map_sensor = cloud.T_map_sensor;
    scan.sensor = cloud.organised ? SensorKind::depth_camera : SensorKind::lidar;  // if its rays do not tell
    result.shift = cloud.shift;
    result.times = std::move(cloud.times);
    return result;
  }

  /// For a scan that cannot be read.
  SensorKind sensor_of(const io::ListedRecording& recording, const io::ListedScan& listed) const {
    if (const auto known = rules_.kind(sensor_id(recording, listed))) return *known;
    return is_image(recording, listed) ? SensorKind::depth_camera : SensorKind::lidar;
  }

  void check_size(const io::DepthImage& image, const fs::path& file) {
    if (image_width_ == 0) {
      image_width_ = image.width;
      image_height_ = image.height;
    }
    if (image.width != image_width_ || image.height != image_height_)
      throw Error(Error::Kind::data, file.string(),
                  io::size_text(image.width, image.height) + " pixels, but the images before have " +
                      io::size_text(image_width_, image_height_),
                  "the images of a recording are of one camera");
  }

  static Eigen::Isometry3d own_pose(const io::ListedScan& listed) {
    const io::PoseFile file = io::read_poses(listed.pose_file);
    if (file.poses.size() != 1)
      throw Error(Error::Kind::data, listed.pose_file.string(),
                  std::to_string(file.poses.size()) + " poses for one scan");
    return io::rigid(file.poses[0].T, file.poses[0].where);
  }

  /// Given time stamps are used unless they would decrease from one recording to the next; without any, scans
  /// follow at the sensor's rate.
  double stamp(const io::ListedScan& listed, SensorKind sensor) {
    const double rate = options_.rate_hz.value_or(sensor == SensorKind::lidar ? 10 : 30);
    double now = next_stamp();
    if (listed.stamp_s) {
      if (!shift_s_) shift_s_ = rate_ > 0 ? std::max(0.0, now - *listed.stamp_s) : 0.0;
      now = *listed.stamp_s + *shift_s_;
    }
    if (listed.stamp_s || rate != rate_) {
      since_s_ = now;
      steps_ = 0;
      rate_ = rate;
    }
    ++steps_;
    return now;
  }

  /// The time of a next scan without time stamp; from a count, so that rounding does not accumulate.
  double next_stamp() const { return rate_ > 0 ? since_s_ + static_cast<double>(steps_) / rate_ : 0; }

  std::vector<io::ListedRecording> recordings_;
  ScanSourceOptions options_;
  io::ReadingRules rules_;
  std::optional<Scan> first_;  // read on opening
  std::vector<std::string> skipped_, notes_;
  std::vector<Motions> motions_;  // of each recording
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::size_t size_ = 0, good_ = 0;
  std::size_t recording_ = 0, index_ = 0;
  bool own_noted_ = false;
  int image_width_ = 0, image_height_ = 0;  // of this recording's first image
  std::optional<double> shift_s_;           // of this recording's time stamps
  double since_s_ = 0, rate_ = 0;           // rate 0: no scan yet
  std::size_t steps_ = 0;                   // since since_s_
};

}  // namespace

InputKind classify(const fs::path& input) {
  std::error_code error;
  const auto status = fs::status(input, error);
  if (!fs::exists(status)) throw Error(Error::Kind::data, input.string(), "no such file or folder");
  if (fs::is_directory(status)) return InputKind::scans;
  const io::FileKind kind = fs::is_regular_file(status) ? io::kind_of(input) : io::FileKind::unknown;
  if (kind == io::FileKind::occupancy_map) return InputKind::occupancy_map;
  if (kind != io::FileKind::unknown) return InputKind::scans;
  if (input.extension() == ".surfaces")
    throw Error(Error::Kind::data, input.string(), "a saved map, not scans", "resume it by --resume");
  throw Error(Error::Kind::data, input.string(), "not a kind of file that is read",
              "give depth images (PNG, PGM), clouds (PCD, PLY, velodyne .bin), a bag (.bag, .db3, .mcap), a "
              ".graph, .bt or .ot");
}

std::unique_ptr<ScanSource> open_scans(const std::vector<fs::path>& inputs,
                                       const ScanSourceOptions& options) try {
  return std::make_unique<FileScanSource>(io::list_scans(inputs, options), options);
} catch (const fs::filesystem_error& error) {
  throw Error(Error::Kind::data, error.path1().string(), error.code().message());
}

}  // namespace octosurf
