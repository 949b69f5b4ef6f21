#include "run_scans.hpp"

#include "arrivals.hpp"
#include "cloud_viewpoint.hpp"
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
  run.scans_listed = source->size();
  alone_ = run.scans_listed == 1 && !run.options.source.poses;
  held_ = surfaces::state_of(run.mapper.map()).held;
  std::sort(held_.begin(), held_.end());
  feed_ = std::make_unique<ScanFeed>(std::move(source), range, run.options.realtime ? most_joined : 1,
                                     [this](Scan& scan) { return accept(scan); });
  run.feed = feed_.get();
  if (feed_->size() == 0 && range.parts > 1)
    throw Error(Error::Kind::usage,
                "--subset " + std::to_string(range.part) + "/" + std::to_string(range.parts),
                "is empty, as there are fewer scans than parts", "take fewer parts");
  if (range.parts > 1)
    std::printf("part %zu of %zu: %s\n", range.part, range.parts,
                io::count_of(feed_->size(), "scan").c_str());
  if (feed_->size() == 0)
    throw Error(Error::Kind::usage, "--skip",
                "leaves none of the " + std::to_string(run.scans_listed) + " scans");
}

void RunScans::require_metres(const Scan& scan) const {
  constexpr double farthest =
      300;  // m: no robot's sensor reaches so far, and such rays take hours and all memory
  const Parameters& parameters = run_.mapper.map().parameters();
  if (scan.sensor != SensorKind::lidar || parameters.occupancy.max_range || run_.options.source.cloud_scale)
    return;
  std::vector<float> ranges;
  for (const Eigen::Vector3f& point : scan.points)
    if (const float range = point.norm(); std::isfinite(range)) ranges.push_back(range);
  if (ranges.empty() || static_cast<double>(geometry::median_of(ranges)) <= farthest) return;
  throw Error(Error::Kind::data, scan.name,
              "most of its readings reach farther than 300 m, as if not in metres",
              "--cloud-scale 1000 for millimetres, 100 for centimetres; 1, if they are metres");
}

bool RunScans::accept(Scan& scan) {
  if (std::exchange(first_, false)) require_metres(scan);
  place(scan);
  require_near(scan);
  return held_.empty() || !std::binary_search(held_.begin(), held_.end(), sensing::fingerprint_of(scan));
}

void RunScans::place(Scan& cloud) const {
  cloud.T_map_sensor = sensing::pose_from(run_.options.pose_form, cloud.T_map_sensor);
  const bool posed = cloud.T_map_sensor.matrix() != Eigen::Isometry3d::Identity().matrix();
  if (const std::vector<double>& viewpoint = run_.options.viewpoint; !viewpoint.empty()) {
    if (posed)
      throw Error(Error::Kind::usage, "--viewpoint", cloud.name + " has a pose already",
                  "give it with clouds that have none");
    return set_viewpoint(cloud, Eigen::Map<const Eigen::Vector3d>(viewpoint.data()));
  }
  if (posed || !alone_ || cloud.sensor != SensorKind::lidar) return;
  const Parameters& parameters = run_.mapper.map().parameters();
  const auto found = likely_viewpoint(cloud, parameters.up.value_or(Eigen::Vector3d::UnitZ()),
                                      parameters.occupancy.resolution);
  if (!found) return;
  std::fprintf(
      stderr,
      "warning: %s does not say where it was seen from; from the origin %.0f %% of its readings would "
      "lie behind others, from above %.0f %%: taken as seen from %.2f %.2f %.2f; --viewpoint X Y Z says "
      "where it was\n",
      cloud.name.c_str(), 100 * found->hidden_origin, 100 * found->hidden, found->at.x(), found->at.y(),
      found->at.z());
  set_viewpoint(cloud, found->at);
}

void RunScans::require_near(const Scan& scan) const {
  constexpr double farthest = 1e8;  // m: nothing on Earth is, and doubles resolve 10 nm there
  const Eigen::Vector3d place = scan.T_map_sensor.translation() + run_.mapper.map().origin();
  if (place.lpNorm<Eigen::Infinity>() <= farthest) return;
  throw Error(Error::Kind::data, scan.name, "its pose lies " + io::text_of(place) + " m from 0",
              "check that poses are in metres, and of the form that --pose-form says");
}

void RunScans::finish() {
  run_.feed = nullptr;

  // Values without a return that only later scans have.
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
