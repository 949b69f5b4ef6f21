#include "alignment/scan_aligner.hpp"
#include "mapper/map_change.hpp"
#include "mapper/merge_maps.hpp"
#include "mapper/stopwatch.hpp"
#include "sensing/fingerprint.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/space_part.hpp>

namespace octosurf {
namespace {

/// The offset between a surface and the centre of a voxel it crosses is uniform over the edge, except for
/// surfaces parallel to the grid, whose voxels all have the same offset.
void observe_voxel_centres(const std::vector<occupancy::VoxelPoint>& adopted, surfaces::MapState& state) {
  if (adopted.empty()) return;
  const double d = state.parameters.occupancy.resolution, variance = d * d / 12;
  state.noise.observe(std::array{sensing::SharedVariance{adopted.front().range_class, variance},
                                 sensing::SharedVariance{0, variance}});
}

/// m: readings beyond it only free space.
double max_range_of(const OccupancyParameters& parameters, const Scan& scan) {
  return parameters.max_range.value_or(sensing::default_max_range(scan.sensor));
}

bool as_stated(const Scan& scan, const Alignment& alignment) {
  return alignment.T_map_sensor.matrix() == scan.T_map_sensor.matrix();
}

void require_threads(int threads) {
  if (threads < 1 || threads > 256)
    throw Error(Error::Kind::usage, "threads", "is " + std::to_string(threads), "must be in [1, 256]");
}

const Scan& scan_of(const Scan& scan) { return scan; }
const Scan& scan_of(const PreparedScan& prepared) { return prepared.scan(); }

}  // namespace

struct PreparedScan::Rays {
  double resolution, min_range;  // m, of the tracing mapper
  sensing::VoxelScan voxels;
  occupancy::TouchedVoxels touched;
  ScanReport times;  // only `stage_ms` and `total_ms`
};

struct Mapper::Impl {
  using Rays = std::shared_ptr<const PreparedScan::Rays>;

  Impl(Map&& m, int thread_count, const detection::Detector& detects)
      : map(std::move(m)),
        threads(thread_count),
        detector(detects),
        downsample(surfaces::state_of(map).occupancy.grid()),
        trace_rays(surfaces::state_of(map).occupancy.grid()) {}

  /// As if the scan had been taken from there. In any thread: reads only the map's parameters.
  Rays trace(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, int by_threads);
  static Rays rays_of(const Scan&) { return nullptr; }
  static Rays rays_of(const PreparedScan& prepared) { return prepared.rays_; }
  /// Whether they are what trace() finds at the scan's stated pose.
  bool fit(const PreparedScan::Rays& rays, const Scan& scan) const;

  /// A scan that passed all checks, and where and how it is inserted.
  struct Checked {
    ScanReport report;
    alignment::AlignedScan aligned;
    Rays rays;  // null if the scan is rejected
  };
  /// Throws as insert() does. Changes nothing in the map. `rays`: prepared ones, or null.
  Checked check(surfaces::MapState& state, const Scan& scan, Rays rays);
  /// `scans`: a span of Scan or PreparedScan.
  template <class Scans>
  std::vector<ScanReport> insert_all(Scans scans);
  /// By another cause than a scan.
  ScanReport change_map(mapper::Effort effort, const std::function<void(mapper::MapChange&)>& change_octree);
  /// By occupied voxels that no scan was seen to hit.
  ScanReport take_voxels(const std::function<occupancy::OccupancyDelta(occupancy::OccupancyMap&)>& take);

  Map map;
  int threads;
  const detection::Detector& detector;
  std::mutex tracing;  // guards the next two
  sensing::Downsampler downsample;
  occupancy::RayTracer trace_rays;
  std::atomic<bool> pose_corrected = false;  // the last one: then the next one probably will be, too
  alignment::ScanAligner align;
  bool remember_scans = false;
};

Mapper::Mapper(const Parameters& parameters, int threads, const detection::Detector* paper)
    : Mapper(Map(parameters), threads, paper) {}
Mapper::Mapper(int threads, const detection::Detector* paper, Map& map) {
  require_threads(threads);
  // Throws for an incomplete map or a missing detector, while the caller still owns the map.
  const detection::Detector& detector =
      detection::detector_of(surfaces::state_of(std::as_const(map)).parameters, paper);
  impl_ = std::make_unique<Impl>(std::move(map), threads, detector);
}
Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;
Mapper::~Mapper() = default;

Mapper::Impl::Rays Mapper::Impl::trace(const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                                       int by_threads) {
  const OccupancyParameters& parameters = map.parameters().occupancy;
  const auto rays = std::make_shared<PreparedScan::Rays>();
  rays->resolution = parameters.resolution;
  rays->min_range = parameters.min_range;
  const std::lock_guard lock(tracing);
  mapper::Stopwatch time(rays->times);
  rays->voxels = time(Stage::downsample, [&] {
    return downsample(scan, T_map_sensor, parameters.min_range, max_range_of(parameters, scan), by_threads);
  });
  rays->touched = time(Stage::occupancy, [&] { return trace_rays(rays->voxels, downsample, by_threads); });
  return rays;
}

bool Mapper::Impl::fit(const PreparedScan::Rays& rays, const Scan& scan) const {
  const OccupancyParameters& parameters = map.parameters().occupancy;
  return rays.resolution == parameters.resolution && rays.min_range == parameters.min_range &&
         rays.voxels.max_range == max_range_of(parameters, scan);
}

PreparedScan Mapper::prepare(Scan scan) const {
  PreparedScan prepared(std::move(scan));
  if (impl_->pose_corrected) return prepared;
  try {
    const Eigen::Isometry3d& T_map_sensor = prepared.scan_.T_map_sensor;
    require_rigid(T_map_sensor, prepared.scan_.name);
    prepared.rays_ = impl_->trace(prepared.scan_, T_map_sensor, 1);
  } catch (const std::exception&) {  // the insertion does this again, and throws
  }
  return prepared;
}

Mapper::Impl::Checked Mapper::Impl::check(surfaces::MapState& state, const Scan& scan, Rays rays) {
  require_rigid(scan.T_map_sensor, scan.name);
  const OccupancyParameters& parameters = state.parameters.occupancy;
  const double max_range = max_range_of(parameters, scan);

  Checked checked;
  ScanReport& report = checked.report;
  report.points_raw = scan.points.size();
  mapper::Stopwatch time(report);
  checked.aligned = time(Stage::align, [&] { return align(state, scan, {parameters.min_range, max_range}); });
  report.alignment = checked.aligned.alignment;
  pose_corrected = !as_stated(scan, report.alignment);
  if (report.alignment.outcome == AlignmentOutcome::rejected) return checked;
  if (pose_corrected || !rays || !fit(*rays, scan))
    rays = trace(scan, report.alignment.T_map_sensor, threads);
  checked.rays = std::move(rays);
  mapper::add_times(checked.rays->times, report);
  const sensing::VoxelScan& voxels = checked.rays->voxels;
  report.points_not_finite = voxels.not_finite;
  report.points_too_near = voxels.too_near;
  report.points_out_of_map = voxels.out_of_map;
  report.points_beyond_range = voxels.beyond_range;
  report.voxels = voxels.ends.size();
  return checked;
}

ScanReport Mapper::insert(const Scan& scan) { return std::move(insert_all({&scan, 1}).front()); }
ScanReport Mapper::insert(const PreparedScan& prepared) {
  return std::move(insert_all({&prepared, 1}).front());
}
std::vector<ScanReport> Mapper::insert_all(std::span<const Scan> scans) { return impl_->insert_all(scans); }
std::vector<ScanReport> Mapper::insert_all(std::span<const PreparedScan> scans) {
  return impl_->insert_all(scans);
}

template <class Scans>
std::vector<ScanReport> Mapper::Impl::insert_all(Scans scans) {
  surfaces::MapState& state = surfaces::state_of(map);
  std::optional<mapper::MapChange> change;
  bool detected = false;
  for (const auto& given : scans) {
    const Scan& scan = scan_of(given);
    std::optional<Checked> checked;
    try {
      checked = check(state, scan, rays_of(given));
    } catch (const Error&) {
      if (!change) throw;
      break;
    }
    if (!change) change.emplace(state, detector, mapper::Effort::turn, threads);
    change->begin(std::move(checked->report));
    alignment::record_of(state).apply(std::move(checked->aligned.state), checked->aligned.patches);
    if (!checked->rays) continue;  // the scan is rejected
    change->insert(scan, checked->rays->voxels, checked->rays->touched, checked->aligned.shared);
    if (remember_scans) state.held.push_back(sensing::fingerprint_of(scan));
    // One scan's points lie thinner about their planes than several scans' together: detect in the first
    // scan, then expand by the others.
    if (!std::exchange(detected, true)) change->update();
  }
  return change ? change->commit() : std::vector<ScanReport>{};
}

ScanReport Mapper::Impl::change_map(mapper::Effort effort,
                                    const std::function<void(mapper::MapChange&)>& change_octree) {
  mapper::MapChange change(surfaces::state_of(map), detector, effort, threads);
  change_octree(change);
  return std::move(change.commit().back());
}

ScanReport Mapper::drain() {
  if (surfaces::state_of(impl_->map).queue.blocks.empty()) return {};
  return impl_->change_map(mapper::Effort::all, [](mapper::MapChange& change) {
    change.begin();
    change.update();
  });
}

ScanReport Mapper::Impl::take_voxels(
    const std::function<occupancy::OccupancyDelta(occupancy::OccupancyMap&)>& take) {
  surfaces::MapState& state = surfaces::state_of(map);
  return change_map(mapper::Effort::all, [&](mapper::MapChange& change) {
    ScanReport& report = change.begin();
    const occupancy::OccupancyDelta delta =
        mapper::Stopwatch(report)(Stage::occupancy, [&] { return take(state.occupancy); });
    observe_voxel_centres(delta.appeared, state);
    report.points_raw = report.voxels = delta.appeared.size();
    change.retract(delta);
  });
}

ScanReport Mapper::detect_in_occupancy() {
  return impl_->take_voxels([](occupancy::OccupancyMap& octree) {
    return occupancy::OccupancyDelta{.appeared = octree.adopt_occupied_voxels()};
  });
}

ScanReport Mapper::replace_occupancy(const Map& other) {
  const double d = surfaces::state_of(impl_->map).parameters.occupancy.resolution,
               theirs = other.parameters().occupancy.resolution;
  // Files have six digits of it. At the octree's edge, 2¹⁵ voxels away, places are then less than one off.
  if (!(std::abs(theirs - d) <= 1e-5 * d))
    throw Error(Error::Kind::data, "octree",
                "has voxels of " + std::to_string(theirs) + " m, and the map of " + std::to_string(d) + " m",
                "write it anew at the map's resolution");
  if (&other == &impl_->map) return {};
  return impl_->take_voxels(
      [&](occupancy::OccupancyMap& octree) { return octree.replace(surfaces::state_of(other).occupancy); });
}

ScanReport Mapper::merge(const Map& other, const Eigen::Isometry3d& T_map_other) {
  surfaces::MapState& state = surfaces::state_of(impl_->map);
  const surfaces::MapState& theirs = surfaces::state_of(other);
  mapper::require_mergeable(state, theirs, T_map_other);
  ScanReport report;
  if (theirs.occupancy.empty()) return report;
  std::optional<occupancy::OccupancyMap> resampled;
  if (T_map_other.matrix() != Eigen::Matrix4d::Identity())
    resampled = occupancy::OccupancyMap::resampled(theirs.occupancy, T_map_other, state.parameters.occupancy,
                                                   report.points_out_of_map);
  report.points_raw = theirs.points;
  report.voxels = theirs.points;
  return impl_->change_map(mapper::Effort::all, [&](mapper::MapChange& change) {
    mapper::Stopwatch time(change.begin(std::move(report)));
    const occupancy::OccupancyMap::Merged merged = time(
        Stage::occupancy, [&] { return state.occupancy.merge(resampled ? *resampled : theirs.occupancy); });
    mapper::add_records(state, theirs, T_map_other);
    change.retract(merged.delta);
    time(Stage::detect,
         [&] { mapper::adopt_surfaces(change.ledger(), merged, theirs.surfaces, T_map_other); });
  });
}

ScanReport Mapper::clear(const SpacePart& part, bool as_free) {
  require_rigid(part.T_map_part, "T_map_part");
  if (!(part.half_size.minCoeff() > 0) || !part.half_size.allFinite())
    throw Error(Error::Kind::usage, "half_size", "is not that of a part of space",
                "give positive lengths in m");
  return impl_->change_map(mapper::Effort::turn, [&](mapper::MapChange& change) {
    mapper::Stopwatch time(change.begin());
    change.retract(time(Stage::occupancy,
                        [&] { return surfaces::state_of(impl_->map).occupancy.clear(part, as_free); }));
  });
}

void Mapper::share_octree(bool on) {
  surfaces::MapState& state = surfaces::state_of(impl_->map);
  auto next = std::make_shared<Snapshot>(*state.snapshot.latest());
  next->octree = on ? state.occupancy.share() : OccupancyView();
  state.octree_shared = on;
  state.snapshot.store(std::move(next));
}

void Mapper::remember_scans() { impl_->remember_scans = true; }
std::shared_ptr<const Snapshot> Mapper::snapshot() const { return impl_->map.snapshot(); }
const Map& Mapper::map() const {
  surfaces::state_of(impl_->map);  // restored
  return impl_->map;
}
Map Mapper::release() && {
  surfaces::state_of(impl_->map);  // restored
  return std::move(impl_->map);
}

}  // namespace octosurf
