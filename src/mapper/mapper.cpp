#include "alignment/scan_aligner.hpp"
#include "detection/cylinders.hpp"
#include "detection/detection.hpp"
#include "expansion/expansion.hpp"
#include "mapper/adopt_surfaces.hpp"
#include "mapper/merge_maps.hpp"
#include "sensing/rounded_scan.hpp"
#include "upkeep/derive.hpp"
#include "upkeep/retract.hpp"
#include "upkeep/revise.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

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

/// Of the points that are still there.
std::vector<Index> indices_of(PointWindow& window, std::span<const std::vector<VoxelKey>> of_scans) {
  std::vector<Index> indices;
  for (const std::vector<VoxelKey>& keys : of_scans)
    for (const VoxelKey key : keys)
      if (const Index i = window.find(key); i != PointWindow::none) indices.push_back(i);
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
  keys.insert(keys.end(), work.requeued.begin(), work.requeued.end());
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

/// What scans that went into the octree have left to the surfaces.
struct Backlog {
  Backlog() = default;
  /// Of what came without a scan.
  explicit Backlog(ScanReport report) : reports{std::move(report)}, appeared(1) {}

  std::vector<ScanReport> reports;
  std::vector<std::vector<VoxelKey>> appeared;  ///< of each report; none if the scan was set aside
  std::size_t searched = 0;                     ///< of these, in which surfaces were looked for
  std::optional<Workspace> work;                ///< of the scan last applied
  std::optional<Expansion> expansion;           ///< likewise
  const ForeignSurfaces* foreign = nullptr;     ///< that another map has on what appeared
};

std::vector<VoxelKey> keys_of(const std::vector<VoxelPoint>& points) {
  std::vector<VoxelKey> keys;
  keys.reserve(points.size());
  for (const VoxelPoint& p : points) keys.push_back(p.key);
  return keys;
}

/// Goes on where the scan before stopped, with a window on the octree as it is now.
void renew(Backlog& backlog, MapState& state) {
  Changes changes;
  std::vector<VoxelKey> requeued;
  if (backlog.work) {
    changes = std::move(backlog.work->changes);
    requeued = std::move(backlog.work->requeued);
  }
  backlog.work.emplace(state);
  backlog.work->changes = std::move(changes);
  backlog.work->requeued = std::move(requeued);
  backlog.expansion.emplace(*backlog.work);
}

/// What each scan's delta asks at once, because the next one builds on it: docs/design.md §4, step 3.
void take_out(Backlog& backlog, MapState& state, const VoxelScan& scan, const OccupancyDelta& delta,
              ScanReport& report) {
  Stopwatch time(report);
  state.points += delta.appeared.size();
  state.points -= delta.vanished.size();
  report.appeared = delta.appeared.size();
  report.vanished = delta.vanished.size();
  renew(backlog, state);
  time(Stage::cylinders, [&] { retract_cylinders(*backlog.work, delta); });
  time(Stage::retract, [&] {
    retract(*backlog.work, delta);
    accumulate_evidence(*backlog.work, scan, delta.confirmed);
  });
  backlog.appeared.back() = keys_of(delta.appeared);
}

/// Steps 4 to 6, for the scans in which surfaces have not been looked for.
void find_surfaces(Backlog& backlog, MapState& state) {
  Stopwatch time(backlog.reports.back());
  Workspace& work = *backlog.work;
  Expansion& expansion = *backlog.expansion;
  const std::vector<Index> appeared =
      indices_of(work.window, std::span(backlog.appeared).subspan(backlog.searched));
  backlog.searched = backlog.appeared.size();
  std::vector<Index> left = time(Stage::add_inliers, [&] { return expansion.add_inliers(appeared); });
  if (backlog.foreign != nullptr)
    time(Stage::detect, [&] { expansion.adopt(adopt_surfaces(work, appeared, *backlog.foreign)); });
  time(Stage::expand, [&] { expansion.expand(left); });
  time(Stage::detect, [&] {
    std::vector<VoxelKey> pending;
    for (const Index i : left)
      if (work.window[i].surface == 0) pending.push_back(work.window[i].key);
    accumulate(state, work, std::move(pending));
    work.requeued.clear();
    expansion.grow(detect(work));
  });
}

void count_categorized(Backlog& backlog) {
  Workspace& work = *backlog.work;
  for (std::size_t scan = 0; scan < backlog.reports.size(); ++scan)
    for (const VoxelKey key : backlog.appeared[scan])
      if (const Index i = work.window.find(key); i != PointWindow::none)
        backlog.reports[scan].categorized += work.window[i].surface != 0;
}

/// Steps 7 to 9. The reports are complete before derive() publishes, so that what fails has published
/// nothing.
void update_surfaces(Backlog& backlog, MapState& state) {
  ScanReport& report = backlog.reports.back();
  Stopwatch time(report);
  Workspace& work = *backlog.work;
  time(Stage::revise, [&] {
    if (state.parameters.aligned()) backlog.expansion->rejoin();
    refit(work);
    accumulate(state, work, {});
  });
  // Last, when the planes have all their points: cylinders never change them.
  time(Stage::cylinders, [&] { update_cylinders(work); });

  count_categorized(backlog);
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
  VoxelScan group(const MapState& state, const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                  double max_range) {
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

  /// A scan that nothing speaks against, ready to be inserted.
  struct Prepared {
    ScanReport report;
    AlignmentState alignment;
    bool set_aside = false;
    VoxelScan voxels;
    OccupancyMap::Touched touched;
  };
  /// Throws what insert() throws. Changes nothing.
  Prepared prepare(MapState& state, const Scan& scan);
  /// From its first change on whatever is thrown leaves the map unusable.
  void apply(MapState& state, const Scan& scan, Prepared prepared, Backlog& backlog);
  /// Brings the surfaces up to date; the map is whole again.
  std::vector<ScanReport> finish(MapState& state, Backlog& backlog);

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

Mapper::Impl::Prepared Mapper::Impl::prepare(MapState& state, const Scan& scan) {
  require_rigid(scan.T_map_sensor, scan.name);
  require_readings(scan);
  if (!NoiseModel::takes(scan))
    throw Error(Error::Kind::data, scan.name, "its noise makes no sense", "leave it out");
  const OccupancyParameters& parameters = state.parameters.occupancy;
  const double max_range = parameters.max_range.value_or(default_max_range(scan.sensor));

  Prepared prepared;
  ScanReport& report = prepared.report;
  report.points_raw = scan.points.size();
  Stopwatch time(report);
  AlignmentState& alignment = prepared.alignment = state.alignment;
  report.alignment = time(Stage::align, [&] {
    // An archive's poses were aligned when its scans were mapped.
    if (!state.parameters.alignment.enabled || !scan.readings.empty()) return as_given(scan);
    return align(alignment, *state.snapshot.load(), scan, state.noise, {parameters.min_range, max_range});
  });
  prepared.set_aside = report.alignment.outcome == AlignmentOutcome::set_aside;
  if (prepared.set_aside || report.alignment.outcome == AlignmentOutcome::unexplained)
    alignment.note_misfit(
        {report.alignment.T_map_sensor.translation(), farthest_reading(scan, max_range), prepared.set_aside});
  if (prepared.set_aside) return prepared;
  VoxelScan& voxels = prepared.voxels =
      time(Stage::downsample, [&] { return group(state, scan, report.alignment.T_map_sensor, max_range); });
  report.points_not_finite = voxels.not_finite;
  report.points_too_near = voxels.too_near;
  report.points_out_of_map = voxels.out_of_map;
  report.points_beyond_range = voxels.beyond_range;
  report.voxels = voxels.ends.size();
  require_ids(state, voxels.ends.size(), scan.name);
  prepared.touched = time(Stage::occupancy, [&] { return state.occupancy.trace(voxels, threads); });
  return prepared;
}

void Mapper::Impl::apply(MapState& state, const Scan& scan, Prepared prepared, Backlog& backlog) {
  ScanReport& report = backlog.reports.emplace_back(std::move(prepared.report));
  backlog.appeared.emplace_back();
  Stopwatch time(report);
  if (!prepared.set_aside) state.unfinished_scan = state.scans + 1;
  state.alignment = std::move(prepared.alignment);
  if (prepared.set_aside) return;
  const OccupancyDelta delta = time(Stage::occupancy, [&] {
    return state.occupancy.apply(prepared.touched, prepared.voxels, downsample,
                                 state.parameters.occupancy.preserve_surfaces ? &state.surfaces : nullptr);
  });
  ++state.scans;
  state.sensors_up += up_of_sensor(scan, report.alignment.T_map_sensor);
  time(Stage::downsample, [&] { state.noise.observe(scan); });
  take_out(backlog, state, prepared.voxels, delta, report);
  last = std::move(prepared.voxels);
  // One scan's points lie thinner about their planes than several scans' together: what is new is looked for
  // in the first, and takes in what the others add.
  if (backlog.searched == 0) find_surfaces(backlog, state);
}

std::vector<ScanReport> Mapper::Impl::finish(MapState& state, Backlog& backlog) {
  if (backlog.work) {
    if (backlog.searched < backlog.appeared.size()) find_surfaces(backlog, state);
    update_surfaces(backlog, state);
  }
  state.unfinished_scan = 0;
  return std::move(backlog.reports);
}

ScanReport Mapper::insert(const Scan& scan) { return std::move(insert_all({&scan, 1}).front()); }

std::vector<ScanReport> Mapper::insert_all(std::span<const Scan> scans) {
  MapState& state = impl_->map.state();
  Backlog backlog;
  for (const Scan& scan : scans) {
    std::optional<Impl::Prepared> prepared;
    try {
      prepared = impl_->prepare(state, scan);
    } catch (const Error&) {
      if (backlog.reports.empty()) throw;
      break;
    }
    impl_->apply(state, scan, std::move(*prepared), backlog);
  }
  return impl_->finish(state, backlog);
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
  Backlog backlog(std::move(report));
  take_out(backlog, state, {}, delta, backlog.reports.back());
  return std::move(impl_->finish(state, backlog).back());
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
  Backlog backlog(std::move(report.changes));
  backlog.foreign = &foreign;
  take_out(backlog, state, {}, merged.delta, backlog.reports.back());
  report.changes = std::move(impl_->finish(state, backlog).back());
  report.surfaces = there.heirs_in(state);
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
