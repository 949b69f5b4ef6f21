#include "mapper/map_change.hpp"

#include "cylinders/cylinders.hpp"
#include "mapper/stopwatch.hpp"
#include "update/derive.hpp"
#include "update/retract.hpp"

#include <algorithm>
#include <iterator>
#include <type_traits>
#include <utility>

namespace octosurf::mapper {
namespace {

/// A camera's y axis points down, a lidar's z axis up; map frame.
Eigen::Vector3d up_of_sensor(const Scan& scan, const Eigen::Isometry3d& T_map_sensor) {
  const Eigen::Vector3d up =
      scan.sensor == SensorKind::depth_camera ? Eigen::Vector3d(0, -1, 0) : Eigen::Vector3d::UnitZ();
  return (T_map_sensor.linear() * up).normalized();
}

}  // namespace

MapChange::Records::Records(const surfaces::MapState& state)
    : noise(state.noise),
      alignment(alignment::record_of(state).state),
      removals(state.removals),
      queue(state.queue),
      points(state.points),
      held(state.held.size()),
      scans(state.scans),
      revision(state.revision),
      sensors_up(state.sensors_up) {}

// A std::deque among the members would take memory to be moved.
static_assert(std::is_nothrow_swappable_v<RemovalLog> &&
              std::is_nothrow_swappable_v<alignment::AlignmentState> &&
              std::is_nothrow_copy_assignable_v<sensing::NoiseModel>);

void MapChange::Records::put_back(surfaces::MapState& state) noexcept {
  state.noise = noise;
  alignment::AlignmentRecord& record = alignment::record_of(state);
  record.patches.roll_back();
  std::swap(record.state, alignment);
  std::swap(state.removals, removals);
  std::swap(state.queue, queue);
  state.points = points;
  state.held.resize(held);  // shrinks
  state.scans = scans;
  state.revision = revision;
  state.sensors_up = sensors_up;
}

MapChange::MapChange(surfaces::MapState& state, const detection::Detector& detector, Effort effort,
                     int threads)
    : state_(state), detector_(detector), effort_(effort), threads_(threads), before_(state) {
  alignment::record_of(state).patches.begin_changes();  // makes the record, which may fail
  state.cylinders.begin_changes();                      // the only other one that allocates
  state.surfaces.begin_changes();
  state.occupancy.begin_changes();
}

MapChange::~MapChange() {
  if (committed_) return;
  ledger_.reset();  // its memory may be needed
  state_.occupancy.roll_back();
  before_.put_back(state_);
  state_.unrestored = true;
  try {
    state_.restore();
  } catch (...) {  // no memory: the next change of the map tries again
  }
}

ScanReport& MapChange::begin(ScanReport report) {
  appeared_.emplace_back();
  return reports_.emplace_back(std::move(report));
}

surfaces::Ledger& MapChange::ledger() {
  if (!ledger_) ledger_.emplace(state_);
  return *ledger_;
}

void MapChange::insert(const Scan& scan, const sensing::VoxelScan& voxels,
                       const occupancy::TouchedVoxels& touched,
                       std::span<const sensing::SharedVariance> shared) {
  ScanReport& report = reports_.back();
  Stopwatch time(report);
  const occupancy::OccupancyDelta delta = time(Stage::occupancy, [&] {
    return state_.occupancy.apply(touched, voxels,
                                  state_.parameters.occupancy.preserve_surfaces ? &state_.surfaces : nullptr);
  });
  ++state_.scans;
  state_.sensors_up += up_of_sensor(scan, report.alignment.T_map_sensor);
  time(Stage::downsample, [&] {
    state_.noise.observe(scan);
    state_.noise.observe(shared);
  });
  retract(delta, &voxels);
}

void MapChange::retract(const occupancy::OccupancyDelta& delta, const sensing::VoxelScan* scan) {
  ScanReport& report = reports_.back();
  Stopwatch time(report);
  state_.points += delta.appeared.size();
  state_.points -= delta.vanished.size();
  report.appeared = delta.appeared.size();
  report.vanished = delta.vanished.size();
  surfaces::Changes so_far;
  if (ledger_) so_far = std::move(ledger_->changes);
  for (const occupancy::VoxelPoint& p : delta.appeared) appeared_.back().push_back(p.key);
  so_far.unprocessed.insert(so_far.unprocessed.end(), appeared_.back().begin(), appeared_.back().end());
  ledger_.emplace(state_, std::move(so_far));
  time(Stage::cylinders, [&] { cylinders::retract_cylinders(*ledger_, delta); });
  time(Stage::retract, [&] {
    update::retract(*ledger_, delta);
    if (scan != nullptr) update::observe_again(*ledger_, *scan, delta.confirmed);
  });
  updated_ = false;
}

void MapChange::update() {
  update_surfaces(ledger(), detector_, effort_, threads_, reports_.back());
  updated_ = true;
}

/// Step 9. Null if nothing has changed.
std::shared_ptr<const surfaces::Published::State> MapChange::next_state() {
  if (!ledger_) return nullptr;
  for (std::size_t scan = 0; scan < reports_.size(); ++scan)
    for (const geometry::VoxelKey key : appeared_[scan])
      if (const PointId i = ledger_->window.find(key); i != PointId::none)
        reports_[scan].categorized += ledger_->window[i].surface != 0;
  const surfaces::Changes& changes = ledger_->changes;
  ScanReport& report = reports_.back();
  report.born.assign(changes.born.begin(), changes.born.end());
  report.grown.assign(changes.grown.begin(), changes.grown.end());
  std::ranges::copy_if(changes.shrunk, std::back_inserter(report.shrunk), [&](SurfaceId id) {
    return !changes.gone.contains(id) && !changes.merged.contains(id);
  });
  report.merged.assign(changes.merged.begin(), changes.merged.end());
  report.gone.assign(changes.gone.begin(), changes.gone.end());
  return Stopwatch(report)(Stage::derive, [&] {
    return update::derive(state_, changes, detector_.traits.outlines_decide, threads_);
  });
}

std::vector<ScanReport> MapChange::commit() {
  if (!updated_) update();
  std::shared_ptr<const surfaces::Published::State> next = next_state();
  if (next) state_.snapshot.store(std::move(next));
  state_.occupancy.commit();
  state_.surfaces.commit();
  state_.cylinders.commit();
  alignment::record_of(state_).patches.commit();
  constexpr std::ptrdiff_t most_held = 100'000;  // an hour at 30 a second
  if (std::ssize(state_.held) >= 2 * most_held)
    state_.held.erase(state_.held.begin(), state_.held.end() - most_held);
  committed_ = true;
  return std::move(reports_);
}

}  // namespace octosurf::mapper
