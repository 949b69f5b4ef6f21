#include "run_scans.hpp"

#include "geometry/median.hpp"
#include "io/text_file.hpp"
#include "sensing/fingerprint.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

RunScans::RunScans(RunState& run, std::unique_ptr<ScanSource> source) : run_(run), notes_(source->notes()) {
  const ScanRange& range = run.options.range;
  for (const std::string& note : notes_) std::printf("%s\n", note.c_str());
  const std::size_t listed = source->size();
  held_ = surfaces::state_of(run.mapper.map()).held;
  std::ranges::sort(held_);
  feed_ =
      std::make_unique<ScanFeed>(std::move(source), range, [this](const Scan& scan) { return accept(scan); });
  if (feed_->size() == 0)
    throw Error(Error::Kind::usage, "--skip", "leaves none of the " + std::to_string(listed) + " scans");
}

void RunScans::require_metres(const Scan& scan) const {
  constexpr double farthest =
      300;  // m: no robot's sensor reaches so far, and such rays take hours and all memory
  const Parameters& parameters = run_.mapper.map().parameters();
  if (scan.sensor != SensorKind::lidar || parameters.occupancy.max_range || run_.options.source.depth_scale)
    return;
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : scan.points)
    if (const float range = point.norm(); std::isfinite(range)) ranges.push_back(range);
  if (ranges.empty() || static_cast<double>(geometry::median_of(ranges)) <= farthest) return;
  throw Error(Error::Kind::data, scan.name,
              "most of its readings reach farther than 300 m, as if not in metres",
              "--depth-scale 1000 for millimetres, 100 for centimetres; 1, if they are metres");
}

bool RunScans::accept(const Scan& scan) {
  if (std::exchange(first_, false)) require_metres(scan);
  require_near(scan);
  return held_.empty() || !std::ranges::binary_search(held_, sensing::fingerprint_of(scan));
}

void RunScans::require_near(const Scan& scan) const {
  constexpr double farthest = 1e8;  // m: nothing on Earth is, and doubles resolve 10 nm there
  const Eigen::Vector3d place = scan.T_map_sensor.translation() + run_.mapper.map().origin();
  if (place.lpNorm<Eigen::Infinity>() <= farthest) return;
  throw Error(Error::Kind::data, scan.name, "its pose lies " + io::text_of(place) + " m from 0",
              "check that poses are in metres, and of the form that --pose-form says");
}

void RunScans::finish() {
  const std::vector<std::string> notes = feed_->notes();
  for (std::size_t i = notes_.size(); i < notes.size(); ++i) std::printf("%s\n", notes[i].c_str());
  const std::vector<std::string> skipped = feed_->skipped();
  run_.context.skipped_scans.insert(run_.context.skipped_scans.begin(), skipped.begin(), skipped.end());
  run_.context.mapped_before = feed_->refused();
  if (feed_->refused() > 0)
    std::printf("%s left out: %s in the map already\n", io::count_of(feed_->refused(), "scan").c_str(),
                feed_->refused() == 1 ? "it is" : "they are");
}

}  // namespace octosurf
