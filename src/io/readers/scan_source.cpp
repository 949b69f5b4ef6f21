#include "io/readers/file_kind.hpp"
#include "io/readers/recorded_scan.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

/// Reads listed scans one after the other.
class FileScanSource : public ScanSource {
 public:
  FileScanSource(io::ScanList list, const ScanSourceOptions& options)
      : list_(std::move(list)), options_(options), rules_(options) {
    for (const auto& recording : list_.recordings) size_ += recording.scans.size();
    if (options_.origin) {
      origin_ = *options_.origin;
    } else if (const auto far = io::far_origin(list_, options_)) {
      origin_ = *far;
      list_.notes.push_back("origin: " + io::text_of(origin_) +
                            " m is subtracted from all coordinates, which are too far from 0 for an octree; "
                            "--origin X Y Z states another");
    }
    for (const auto& recording : list_.recordings)
      motions_.push_back(io::motions_of(recording, options_, list_.notes));
    meet_sensors();
  }

  std::size_t size() const override { return size_; }
  const std::vector<std::string>& skipped() const override { return list_.left_out; }
  Eigen::Vector3d origin() const override { return origin_; }
  std::vector<std::string> notes() const override {
    std::vector<std::string> all = list_.notes;
    all.insert(all.end(), rules_.notes().begin(), rules_.notes().end());
    return all;
  }

  std::optional<Scan> next() override {
    while (const io::ListedScan* const listed = advance()) {
      try {
        Scan scan = read(recording_, *listed);
        scan.stamp_s = stamp(*listed, scan.sensor);
        ++good_;
        return scan;
      } catch (const Error& error) {
        stamp(*listed, kind_of_sensor(*listed));
        if (!options_.skip_bad || error.kind() != Error::Kind::data) throw;
        list_.left_out.push_back(error.what());
      }
    }
    if (options_.skip_bad && std::exchange(good_, 1) == 0)
      throw Error(Error::Kind::data, "", "none of the " + std::to_string(size_) + " scans is good",
                  "the last one: " + list_.left_out.back());
    return std::nullopt;
  }

  bool skip(std::size_t count) override {
    if (options_.skip_bad) return ScanSource::skip(count);
    for (; count > 0; --count) {
      const io::ListedScan* const listed = advance();
      if (listed == nullptr) return false;
      stamp(*listed, kind_of_sensor(*listed));
    }
    return true;
  }

 private:
  /// The next scan of all recordings, null at the end.
  const io::ListedScan* advance() {
    while (recording_ < list_.recordings.size() && index_ == list_.recordings[recording_].scans.size()) {
      ++recording_;
      index_ = 0;
      size_before_.reset();
      stamps_.begin_recording();
    }
    return recording_ < list_.recordings.size() ? &list_.recordings[recording_].scans[index_++] : nullptr;
  }

  /// Looks at the first scans, so that the kinds of their sensors are known before the run. Bad ones are
  /// reported when their turn comes.
  void meet_sensors() {
    constexpr std::size_t looked_at = 20;
    for (std::size_t r = 0; r < list_.recordings.size(); ++r) {
      const auto& scans = list_.recordings[r].scans;
      for (std::size_t i = 0; i < std::min(looked_at, scans.size()); ++i) {
        if (rules_.knows({r, scans[i].sensor})) continue;
        try {
          read(r, scans[i]);
        } catch (const Error& error) {
          if (error.kind() == Error::Kind::usage) throw;
        }
      }
      size_before_.reset();
    }
  }

  /// Motion is undone before an origin is subtracted; points of a survey are in the map's frame and have
  /// none.
  Scan read(std::size_t r, const io::ListedScan& listed) {
    const io::ListedRecording& recording = list_.recordings[r];
    const io::RecordedSensor& sensor = recording.sensors[listed.sensor];
    io::RawScan raw = io::read_posed(recording, listed, options_);
    io::require_size_as_before(raw, size_before_);
    const std::size_t own = io::erase_own(raw.scan, recording, listed, options_.self_boxes);
    if (own > 0 && !std::exchange(own_noted_, true))
      list_.notes.push_back("self-box: " + std::to_string(own) + " of the " +
                            std::to_string(raw.scan.points.size()) + " readings of " + raw.scan.name +
                            " are the robot's own");
    const auto free = rules_.apply(raw.scan, {r, listed.sensor}, sensor.images, sensor.name);
    if (const auto motion = motions_[r].find(listed.sensor); motion != motions_[r].end() && !raw.shifted()) {
      raw.scan.stamp_s = *listed.stamp_s;
      raw.scan = motion->second({std::move(raw.scan), std::move(raw.times)});
    }
    io::move_to_free_rays(raw.scan, free);
    return io::place(std::move(raw), origin_);
  }

  /// For a scan that cannot be read.
  SensorKind kind_of_sensor(const io::ListedScan& listed) const {
    const bool images = list_.recordings[recording_].sensors[listed.sensor].images;
    return rules_.kind({recording_, listed.sensor})
        .value_or(images ? SensorKind::depth_camera : SensorKind::lidar);
  }

  double stamp(const io::ListedScan& listed, SensorKind sensor) {
    return stamps_.next(listed.stamp_s, options_.rate_hz.value_or(sensor == SensorKind::lidar ? 10 : 30));
  }

  io::ScanList list_;
  ScanSourceOptions options_;
  io::ReadingRules rules_;
  std::vector<io::Motions> motions_;  // of each recording
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::size_t size_ = 0, good_ = 0;
  std::size_t recording_ = 0, index_ = 0;
  std::optional<std::pair<int, int>> size_before_;  // of this recording's images
  io::StampSequence stamps_;
  bool own_noted_ = false;
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
