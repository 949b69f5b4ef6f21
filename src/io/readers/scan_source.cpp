#include "io/readers/file_kind.hpp"
#include "io/readers/recorded_scan.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace fs = std::filesystem;

namespace io {
namespace {

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

  void choose_origin() {
    if (options_.origin) {
      origin_ = *options_.origin;
    } else if (const auto far = far_origin(list_, options_)) {
      origin_ = *far;
      list_.notes.push_back("origin: " + text_of(origin_) +
                            " m is subtracted from all coordinates, which are too far from 0 for an octree; "
                            "--origin X Y Z states another");
    }
  }

  void stamp_all() {
    StampSequence stamps;
    for (std::size_t r = 0; r < list_.recordings.size(); ++r) {
      const ListedRecording& recording = list_.recordings[r];
      stamps.begin_recording();
      for (std::size_t i = 0; i < recording.scans.size(); ++i) {
        const ListedScan& listed = recording.scans[i];
        const bool lidar = recording.sensors[listed.sensor].kind == SensorKind::lidar;
        const double rate_hz = lidar ? 10 : 30;
        scans_.push_back({r, i, stamps.next(listed.stamp_s, rate_hz)});
      }
    }
  }

  /// In the map's frame.
  Scan read(const Place& place) {
    Scan scan = read(place.recording, list_.recordings[place.recording].scans[place.scan]);
    scan.stamp_s = place.stamp_s;
    return scan;
  }

  /// Motion is undone before an origin is subtracted; a survey's points are in the map's frame and have none.
  Scan read(std::size_t r, const ListedScan& listed) {
    const ListedRecording& recording = list_.recordings[r];
    const RecordedSensor& sensor = recording.sensors[listed.sensor];
    RawScan raw = read_posed(recording, listed, options_);
    require_size_as_before(raw, size_of_[r]);
    const std::size_t own = erase_own(raw.scan, recording, listed, options_.self_boxes);
    if (own > 0 && !std::exchange(own_noted_, true))
      list_.notes.push_back("self-box: " + std::to_string(own) + " of the " +
                            std::to_string(raw.scan.points.size()) + " readings of " + raw.scan.name +
                            " are the robot's own");
    drop_no_returns(raw.scan, sensor.images, options_);
    if (const auto motion = motions_[r].find(listed.sensor); motion != motions_[r].end() && !raw.shifted()) {
      raw.scan.stamp_s = *listed.stamp_s;
      raw.scan = motion->second({std::move(raw.scan), std::move(raw.times)});
    }
    look_from(raw, sensor.images);
    return place(std::move(raw), origin_);
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
