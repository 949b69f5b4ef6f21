#include "alignment/scan_aligner.hpp"
#include "detection/cylinders.hpp"
#include "detection/detection.hpp"
#include "expansion/expansion.hpp"
#include "mapper/adopt_surfaces.hpp"
#include "mapper/merge_maps.hpp"
#include "mapper/rounded_scan.hpp"
#include "surfaces/upkeep.hpp"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <set>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using Index = PointWindow::Index;
using Clock = std::chrono::steady_clock;

/// Runs one stage and notes its time.
class Stopwatch {
 public:
  explicit Stopwatch(ScanReport& report) : report_(report) {}
  template <class Work>
  decltype(auto) operator()(Stage stage, Work&& work) {
    struct Note {
      ScanReport& report;
      std::size_t stage;
      Clock::time_point start = Clock::now();
      ~Note() {
        const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        report.stage_ms[stage] += ms;
        report.total_ms += ms;
      }
    } note{report_, static_cast<std::size_t>(stage)};
    return work();
  }

 private:
  ScanReport& report_;
};

std::vector<Index> indices_of(PointWindow& window, const std::vector<VoxelPoint>& points) {
  std::vector<Index> indices;
  indices.reserve(points.size());
  for (const VoxelPoint& p : points) indices.push_back(window.find(p.key));
  return indices;
}

/// A camera's y points down in its picture, a lidar's z up; map frame.
Eigen::Vector3d up_of_sensor(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) {
  const Eigen::Vector3d up =
      scan.sensor == SensorKind::depth_camera ? Eigen::Vector3d(0, -1, 0) : Eigen::Vector3d::UnitZ();
  return (T_map_sensor.linear() * up).normalized();
}

/// m, of those that are mapped.
double farthest_reading(const Scan& scan, double max_range) {
  float farthest = 0;
  for (const Eigen::Vector3f& point : scan.points)
    if (const float range = point.norm(); range <= static_cast<float>(max_range))  // NaN fails
      farthest = std::max(farthest, range);
  return farthest;
}

Alignment as_given(const Scan& scan) {
  Alignment alignment;
  alignment.T_map_sensor = scan.T_map_sensor;
  return alignment;
}

void accumulate(MapState& state, const Workspace& work, std::vector<VoxelKey> keys) {
  keys.insert(keys.end(), work.returned.begin(), work.returned.end());
  keys.insert(keys.end(), state.accumulated.begin(), state.accumulated.end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  state.accumulated = std::move(keys);
}

/// Refuses a scan that could leave a surface or a cylinder without an id. Each is made of n points at least;
/// detection gives a point away once, and refit() once more where it splits what detection has made.
void require_ids(const MapState& state, std::size_t new_points, const std::string& scan) {
  const std::size_t points = state.points + new_points;
  const std::size_t most = 2 * points / static_cast<std::size_t>(state.parameters.min_surface_points());
  if (most <= std::min(state.surfaces.ids_left(), state.cylinders.ids_left())) return;
  throw Error(Error::Kind::data, scan, "the ids of surfaces could run out", "start a new map");
}

std::vector<SurfaceId> list_of(const std::set<SurfaceId>& ids) { return {ids.begin(), ids.end()}; }

/// Everything after the octree's answer: docs/design.md §4, steps 3 to 7. The report is complete before
/// derive() publishes, so that what fails has published nothing. `foreign`: the surfaces that another map has
/// on what appeared.
void update_surfaces(MapState& state, const VoxelScan& scan, const OccupancyDelta& delta, ScanReport& report,
                     const ForeignSurfaces* foreign = nullptr) {
  Stopwatch time(report);
  state.points += delta.appeared.size();
  state.points -= delta.vanished.size();
  Workspace work(state);
  Expansion expansion(work);

  time(Stage::retract, [&] {
    retract(work, delta);
    confirm(work, scan, delta.confirmed);
    retract_cylinders(work, delta);
  });
  const std::vector<Index> appeared = indices_of(work.window, delta.appeared);
  std::vector<Index> left = time(Stage::add_inliers, [&] { return expansion.add_inliers(appeared); });
  if (foreign != nullptr)
    time(Stage::detect, [&] { expansion.adopt(adopt_surfaces(work, appeared, *foreign)); });
  time(Stage::expand, [&] { expansion.expand(left); });
  time(Stage::detect, [&] {
    std::vector<VoxelKey> pending;
    for (const Index i : left)
      if (work.window[i].surface == 0) pending.push_back(work.window[i].key);
    accumulate(state, work, std::move(pending));
    work.returned.clear();
    expansion.grow(detect(work));
  });
  time(Stage::derive, [&] {
    if (state.parameters.aligned()) expansion.rejoin();
    refit(work);
    accumulate(state, work, {});
  });
  // Last, when every point has settled: whatever becomes of cylinders, planes are not touched by it.
  time(Stage::detect, [&] { update_cylinders(work); });

  report.appeared = delta.appeared.size();
  report.vanished = delta.vanished.size();
  for (const Index i : appeared) report.categorized += work.window[i].surface != 0;
  report.born = list_of(work.changes.born);
  report.grown = list_of(work.changes.grown);
  report.shrunk = list_of(work.changes.shrunk);
  report.merged = list_of(work.changes.merged);
  report.gone = list_of(work.changes.gone);
  time(Stage::derive, [&] { derive(work); });
}

}  // namespace

struct Mapper::Impl {
  explicit Impl(Map m, int thread_count)
      : map(std::move(m)), threads(thread_count), downsample(map.state().occupancy.grid()) {}

  /// By voxel; rounded where that is wanted, or was done before.
  VoxelScan group(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, double max_range) {
    const MapState& state = map.state();
    VoxelScan voxels =
        downsample(scan, T_map_sensor, state.parameters.occupancy.min_range, max_range, threads);
    if (!round_scans && scan.readings.empty()) return voxels;
    if (scan.readings.empty())
      round_scan(voxels, state.occupancy.grid(), state.noise);
    else
      restore_rounded(voxels, state.occupancy.grid());
    downsample.find_anew(voxels);
    return voxels;
  }

  Map map;
  int threads;
  Downsampler downsample;
  ScanAligner align;
  VoxelScan last;
  bool round_scans = false;
};

Mapper::Mapper(const Parameters& parameters, int threads) : Mapper(Map(parameters), threads) {}
Mapper::Mapper(Map map, int threads) : impl_(std::make_unique<Impl>(std::move(map), threads)) {
  if (threads < 1 || threads > 256)
    throw Error(Error::Kind::usage, "threads", "is " + std::to_string(threads), "must be in [1, 256]");
}
Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;
Mapper::~Mapper() = default;

ScanReport Mapper::insert(const Scan& scan) {
  require_rigid(scan.T_map_sensor, scan.name);
  require_readings(scan);
  if (!NoiseModel::takes(scan))
    throw Error(Error::Kind::data, scan.name, "its noise makes no sense", "leave it out");
  MapState& state = impl_->map.state();
  const OccupancyParameters& parameters = state.parameters.occupancy;
  const double max_range = parameters.max_range.value_or(default_max_range(scan.sensor));

  ScanReport report;
  report.points_raw = scan.points.size();
  Stopwatch time(report);
  AlignmentState alignment = state.alignment;
  report.alignment = time(Stage::align, [&] {
    // An archive's poses were aligned when its scans were mapped.
    if (!state.parameters.alignment.enabled || !scan.readings.empty()) return as_given(scan);
    return impl_->align(alignment, *state.snapshot.load(), scan, state.noise,
                        {parameters.min_range, max_range});
  });
  const bool set_aside = report.alignment.outcome == AlignmentOutcome::set_aside;
  if (set_aside || report.alignment.outcome == AlignmentOutcome::unexplained)
    alignment.note_misfit(
        {report.alignment.T_map_sensor.translation(), farthest_reading(scan, max_range), set_aside});
  if (set_aside) {
    state.alignment = std::move(alignment);
    return report;
  }
  VoxelScan voxels =
      time(Stage::downsample, [&] { return impl_->group(scan, report.alignment.T_map_sensor, max_range); });
  report.points_not_finite = voxels.not_finite;
  report.points_too_near = voxels.too_near;
  report.points_out_of_map = voxels.out_of_map;
  report.points_beyond_range = voxels.beyond_range;
  report.voxels = voxels.ends.size();
  require_ids(state, voxels.ends.size(), scan.name);
  const OccupancyMap::Touched touched =
      time(Stage::occupancy, [&] { return state.occupancy.trace(voxels, impl_->threads); });

  // Up to here nothing has changed; from here on whatever is thrown leaves the map unusable.
  state.unfinished_scan = state.scans + 1;
  state.alignment = std::move(alignment);
  const OccupancyDelta delta = time(Stage::occupancy, [&] {
    return state.occupancy.apply(touched, voxels, impl_->downsample,
                                 parameters.preserve_surfaces ? &state.surfaces : nullptr);
  });
  ++state.scans;
  state.sensors_up += up_of_sensor(scan, report.alignment.T_map_sensor);
  time(Stage::downsample, [&] { state.noise.observe(scan); });
  update_surfaces(state, voxels, delta, report);
  state.unfinished_scan = 0;
  impl_->last = std::move(voxels);
  return report;
}

ScanReport Mapper::detect_in_occupancy() {
  MapState& state = impl_->map.state();
  require_ids(state, 0, "octree");
  ScanReport report;
  Stopwatch time(report);
  OccupancyDelta delta;
  state.unfinished_scan = state.scans + 1;
  try {
    time(Stage::occupancy, [&] { delta.appeared = state.occupancy.adopt_occupied_voxels(); });
  } catch (const Error&) {  // refused before the octree was touched
    state.unfinished_scan = 0;
    throw;
  }
  report.points_raw = report.voxels = delta.appeared.size();
  update_surfaces(state, {}, delta, report);
  state.unfinished_scan = 0;
  return report;
}

MergeReport Mapper::merge(const Map& other, const Eigen::Isometry3d& T_map_other) {
  MapState& state = impl_->map.state();
  const MapState& theirs = other.state();
  require_mergeable(state, theirs, T_map_other);
  require_ids(state, theirs.points, "the other map");
  MergeReport report;
  if (theirs.occupancy.empty()) return report;
  Stopwatch time(report.changes);
  const OtherMap there(theirs, T_map_other, state.parameters.occupancy);
  report.changes.points_out_of_map = there.points_lost();
  report.changes.points_raw = theirs.points;
  report.changes.voxels = theirs.points;
  // As in insert(): from here on whatever is thrown leaves the map unusable.
  state.unfinished_scan = state.scans + 1;
  const OccupancyMap::Merged merged =
      time(Stage::occupancy, [&] { return state.occupancy.merge(there.occupancy()); });
  there.hand_over_records(state);
  const ForeignSurfaces foreign{theirs.surfaces, T_map_other, merged.surfaces};
  update_surfaces(state, {}, merged.delta, report.changes, &foreign);
  report.surfaces = there.heirs_in(state);
  state.unfinished_scan = 0;
  return report;
}

void Mapper::share_octree(bool on) {
  MapState& state = impl_->map.state();
  state.octree_shared = on;
  auto next = std::make_shared<Snapshot>(*state.snapshot.load());
  next->octree = on ? state.occupancy.share() : OccupancyView();
  state.snapshot.store(std::move(next));
}

void Mapper::round_scans() { impl_->round_scans = true; }
const VoxelScan& Mapper::last_voxels() const { return impl_->last; }
std::shared_ptr<const Snapshot> Mapper::snapshot() const { return impl_->map.snapshot(); }
const Map& Mapper::map() const {
  impl_->map.state().require_whole();
  return impl_->map;
}
Map Mapper::release() && {
  impl_->map.state().require_whole();
  return std::move(impl_->map);
}

}  // namespace octosurf
