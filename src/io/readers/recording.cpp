#include "io/readers/recording.hpp"

#include "io/text_file.hpp"

#include <algorithm>

#include <octosurf/error.hpp>

namespace octosurf::io {

Recording::Recording(const std::vector<std::filesystem::path>& inputs, const ScanSourceOptions& options)
    : options_(options),
      list_(list_scans(inputs, options)),
      rules_(options),
      size_of_(list_.recordings.size()) {
  choose_origin();
  for (const ListedRecording& recording : list_.recordings)
    motions_.push_back(motions_of(recording, options_, list_.notes));
  meet_sensors();
  stamp_all();
}

void Recording::choose_origin() {
  if (options_.origin) {
    origin_ = *options_.origin;
  } else if (const auto far = far_origin(list_, options_)) {
    origin_ = *far;
    list_.notes.push_back("origin: " + text_of(origin_) +
                          " m is subtracted from all coordinates, which are too far from 0 for an octree; "
                          "--origin X Y Z states another");
  }
}

/// Reads the first scans, so that the kinds of their sensors are known before the run. Bad ones are reported
/// when their turn comes.
void Recording::meet_sensors() {
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
  }
}

void Recording::stamp_all() {
  StampSequence stamps;
  for (std::size_t r = 0; r < list_.recordings.size(); ++r) {
    const ListedRecording& recording = list_.recordings[r];
    stamps.begin_recording();
    for (std::size_t i = 0; i < recording.scans.size(); ++i) {
      const ListedScan& listed = recording.scans[i];
      const bool images = recording.sensors[listed.sensor].images;
      const SensorKind sensor =
          rules_.kind({r, listed.sensor}).value_or(images ? SensorKind::depth_camera : SensorKind::lidar);
      const double rate_hz = options_.rate_hz.value_or(sensor == SensorKind::lidar ? 10 : 30);
      scans_.push_back({r, i, stamps.next(listed.stamp_s, rate_hz)});
    }
  }
}

std::vector<std::string> Recording::notes() const {
  std::vector<std::string> all = list_.notes;
  all.insert(all.end(), rules_.notes().begin(), rules_.notes().end());
  return all;
}

bool Recording::posed_elsewhere() const {
  return std::ranges::any_of(list_.recordings, [](const ListedRecording& recording) {
    const ListedScan& first = recording.scans.front();
    return recording.bag || recording.graph || recording.trajectory || first.pose || !first.pose_file.empty();
  });
}

Scan Recording::read(std::size_t i) {
  const Place& place = scans_.at(i);
  Scan scan = read(place.recording, list_.recordings[place.recording].scans[place.scan]);
  scan.stamp_s = place.stamp_s;
  return scan;
}

/// Motion is undone before an origin is subtracted; points of a survey are in the map's frame and have none.
Scan Recording::read(std::size_t r, const ListedScan& listed) {
  const ListedRecording& recording = list_.recordings[r];
  const RecordedSensor& sensor = recording.sensors[listed.sensor];
  RawScan raw = read_posed(recording, listed, options_);
  require_size_as_before(raw, size_of_[r]);
  const std::size_t own = erase_own(raw.scan, recording, listed, options_.self_boxes);
  if (own > 0 && !std::exchange(own_noted_, true))
    list_.notes.push_back("self-box: " + std::to_string(own) + " of the " +
                          std::to_string(raw.scan.points.size()) + " readings of " + raw.scan.name +
                          " are the robot's own");
  const auto free = rules_.apply(raw.scan, {r, listed.sensor}, sensor.images, sensor.name);
  if (const auto motion = motions_[r].find(listed.sensor); motion != motions_[r].end() && !raw.shifted()) {
    raw.scan.stamp_s = *listed.stamp_s;
    raw.scan = motion->second({std::move(raw.scan), std::move(raw.times)});
  }
  move_to_free_rays(raw.scan, free);
  return place(std::move(raw), origin_);
}

}  // namespace octosurf::io
