#include "detection/cylinders.hpp"
#include "detection/detection.hpp"
#include "expansion/expansion.hpp"
#include "surfaces/upkeep.hpp"

#include <chrono>
#include <numeric>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

constexpr double depth_camera_max_range = 4.0;  // m

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
Eigen::Vector3d up_of_sensor(const Scan& scan) {
  const Eigen::Vector3d up = scan.sensor == SensorKind::depth_camera ? Eigen::Vector3d(0, -1, 0)
                                                                     : Eigen::Vector3d::UnitZ();
  return (scan.T_map_sensor.linear() * up).normalized();
}

void accumulate(MapState& state, const Workspace& work, std::vector<VoxelKey> keys) {
  keys.insert(keys.end(), work.returned.begin(), work.returned.end());
  keys.insert(keys.end(), state.accumulated.begin(), state.accumulated.end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  state.accumulated = std::move(keys);
}

}  // namespace

struct Mapper::Impl {
  explicit Impl(Map m, int thread_count)
      : map(std::move(m)), threads(thread_count), downsample(map.state().occupancy.grid()) {}

  Map map;
  int threads;
  Downsampler downsample;

  /// Everything after the octree's answer: docs/design.md §4, steps 3 to 7.
  void update_surfaces(const VoxelScan& scan, const OccupancyDelta& delta, ScanReport& report);
};

void Mapper::Impl::update_surfaces(const VoxelScan& scan, const OccupancyDelta& delta, ScanReport& report) {
  MapState& state = map.state();
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
  time(Stage::derive, [&] { derive(work); });

  report.appeared = delta.appeared.size();
  report.vanished = delta.vanished.size();
  for (const Index i : appeared) report.categorized += work.window[i].surface != 0;
  const auto list = [](const std::set<SurfaceId>& ids) {
    return std::vector<SurfaceId>(ids.begin(), ids.end());
  };
  report.born = list(work.changes.born);
  report.grown = list(work.changes.grown);
  report.shrunk = list(work.changes.shrunk);
  report.merged = list(work.changes.merged);
  report.gone = list(work.changes.gone);
}

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
  MapState& state = impl_->map.state();
  const OccupancyParameters& parameters = state.parameters.occupancy;
  const double max_range = parameters.max_range.value_or(scan.sensor == SensorKind::depth_camera
                                                             ? depth_camera_max_range
                                                             : std::numeric_limits<double>::infinity());

  ScanReport report;
  report.points_raw = scan.points.size();
  Stopwatch time(report);
  const VoxelScan voxels = time(Stage::downsample, [&] {
    return impl_->downsample(scan, parameters.min_range, max_range, impl_->threads);
  });
  report.points_not_finite = voxels.not_finite;
  report.points_too_near = voxels.too_near;
  report.points_out_of_map = voxels.out_of_map;
  report.points_beyond_range = voxels.beyond_range;
  report.voxels = voxels.ends.size();
  const OccupancyDelta delta = time(Stage::occupancy, [&] {
    return state.occupancy.insert(voxels, impl_->downsample,
                                  parameters.preserve_surfaces ? &state.surfaces : nullptr, impl_->threads);
  });
  ++state.scans;
  state.sensors_up += up_of_sensor(scan);
  time(Stage::downsample, [&] { state.noise.observe(scan); });
  impl_->update_surfaces(voxels, delta, report);
  return report;
}

ScanReport Mapper::detect_in_occupancy() {
  ScanReport report;
  Stopwatch time(report);
  OccupancyDelta delta;
  time(Stage::occupancy, [&] { delta.appeared = impl_->map.state().occupancy.adopt_occupied_voxels(); });
  report.points_raw = report.voxels = delta.appeared.size();
  impl_->update_surfaces({}, delta, report);
  return report;
}

std::shared_ptr<const Snapshot> Mapper::snapshot() const { return impl_->map.snapshot(); }
const Map& Mapper::map() const { return impl_->map; }
Map Mapper::release() && { return std::move(impl_->map); }

}  // namespace octosurf
