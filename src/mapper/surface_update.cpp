#include "mapper/surface_update.hpp"

#include "cylinders/cylinders.hpp"
#include "detection/expand.hpp"
#include "detection/update_surfaces.hpp"
#include "detection/waiting.hpp"
#include "mapper/stopwatch.hpp"
#include "upkeep/derive.hpp"
#include "upkeep/retract.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <span>
#include <utility>

namespace octosurf::mapper {
namespace {

using Index = occupancy::PointWindow::Index;

/// Of the points that are still there.
std::vector<Index> indices_of(const occupancy::PointWindow& window,
                              std::span<const std::vector<geometry::VoxelKey>> of_scans) {
  std::vector<Index> indices;
  for (const std::vector<geometry::VoxelKey>& keys : of_scans)
    for (const geometry::VoxelKey key : keys)
      if (const Index i = window.find(key); i != occupancy::PointWindow::none) indices.push_back(i);
  return indices;
}

std::vector<geometry::VoxelKey> keys_of(const std::vector<occupancy::VoxelPoint>& points) {
  std::vector<geometry::VoxelKey> keys;
  keys.reserve(points.size());
  for (const occupancy::VoxelPoint& p : points) keys.push_back(p.key);
  return keys;
}

void put_in_order(std::vector<geometry::VoxelKey>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// Of what is new, and of what has just been segmented: cylinders that are there take both, new ones begin in
/// what planes do not explain.
cylinders::LeftOver left_for_cylinders(const surfaces::Ledger& ledger,
                                       std::span<const geometry::VoxelKey> fresh,
                                       std::span<const geometry::VoxelKey> segmented) {
  if (!ledger.parameters.detection.detect_cylinders) return {};
  std::vector<geometry::VoxelKey> keys;
  std::set_union(fresh.begin(), fresh.end(), segmented.begin(), segmented.end(), std::back_inserter(keys));
  const auto pending = [&](std::span<const geometry::VoxelKey> from) {
    std::vector<Index> points;
    for (const geometry::VoxelKey key : from)
      if (ledger.is_pending(key)) points.push_back(ledger.window.find(key));
    return points;
  };
  return cylinders::left_over(ledger, pending(keys), pending(segmented));
}

std::vector<SurfaceId> list_of(const std::set<SurfaceId>& ids) { return {ids.begin(), ids.end()}; }

}  // namespace

ScanReport& SurfaceUpdate::add(ScanReport report) {
  appeared_.emplace_back();
  return reports_.emplace_back(std::move(report));
}

/// Goes on where the scan before stopped, with a window on the octree as it is now.
void SurfaceUpdate::renew_ledger() {
  surfaces::Changes changes;
  if (ledger_) changes = std::move(ledger_->changes);
  ledger_.emplace(state_).changes = std::move(changes);
  left_over_ = {};
}

void SurfaceUpdate::retract(const sensing::VoxelScan& scan, const occupancy::OccupancyDelta& delta) {
  ScanReport& report = reports_.back();
  Stopwatch time(report);
  state_.points += delta.appeared.size();
  state_.points -= delta.vanished.size();
  report.appeared = delta.appeared.size();
  report.vanished = delta.vanished.size();
  renew_ledger();
  time(Stage::cylinders, [&] { cylinders::retract_cylinders(*ledger_, delta); });
  time(Stage::retract, [&] {
    upkeep::retract(*ledger_, delta);
    upkeep::accumulate_evidence(*ledger_, scan, delta.confirmed);
  });
  appeared_.back() = keys_of(delta.appeared);
}

std::vector<geometry::VoxelKey> SurfaceUpdate::pending_of(std::vector<geometry::VoxelKey> keys) const {
  std::erase_if(keys, [&](geometry::VoxelKey key) { return !ledger_->is_pending(key); });
  return keys;
}

/// What is new and pending, and what retracting has made so.
std::vector<geometry::VoxelKey> SurfaceUpdate::take_fresh(std::span<const Index> appeared) {
  std::vector<geometry::VoxelKey> fresh = std::exchange(ledger_->changes.requeued, {});
  for (const Index i : appeared) fresh.push_back(ledger_->window[i].key);
  put_in_order(fresh);
  return pending_of(std::move(fresh));
}

void SurfaceUpdate::find_surfaces(const ForeignSurfaces* foreign) {
  const std::vector<Index> appeared = indices_of(ledger_->window, std::span(appeared_).subspan(searched_));
  searched_ = appeared_.size();
  Stopwatch time(reports_.back());
  if (foreign != nullptr) time(Stage::detect, [&] { adopt_surfaces(*ledger_, appeared, *foreign); });
  const std::vector<geometry::VoxelKey> fresh = take_fresh(appeared);
  const SurfaceId first_new = state_.surfaces.next_id();
  const std::size_t added = time(Stage::add_inliers, [&] {
    const std::vector<detection::Assignment> inliers = detection::add_inliers(*ledger_, fresh);
    detection::assign(*ledger_, inliers);
    return inliers.size();
  });
  std::vector<detection::Assignment> gained =
      time(Stage::expand, [&] { return detection::expand(*ledger_, pending_of(fresh)); });
  detection::Waiting waiting;
  const detection::Detected detected = time(Stage::detect, [&] {
    waiting = detection::due_to_segment(*ledger_, state_.occupancy, std::move(state_.accumulated),
                                        pending_of(fresh), gained);
    detection::assign(*ledger_, gained);
    return detection::detect(*ledger_, state_.occupancy, waiting.due, detection::touching(*ledger_, gained));
  });
  time(Stage::expand, [&] {
    const std::vector<detection::Assignment> more =
        detection::expand(*ledger_, detection::pending_beside(*ledger_, detected.assigned));
    detection::assign(*ledger_, more);
    gained.insert(gained.end(), more.begin(), more.end());
  });
  reports_.back().added += added;
  std::set<SurfaceId> grown;
  for (const detection::Assignment& assignment : gained) {
    grown.insert(assignment.surface);
    reports_.back().expanded += assignment.surface < first_new;
  }
  for (const geometry::VoxelKey key : detected.assigned)
    reports_.back().detected += ledger_->window[ledger_->window.find(key)].surface < first_new;
  time(Stage::revise, [&] { detection::revise(*ledger_, state_.occupancy, std::move(grown)); });
  state_.accumulated = std::move(waiting.left);
  for (const geometry::VoxelKey key : detection::waiting_on(detected.too_few))
    if (ledger_->is_pending(key)) state_.accumulated.push_back(key);
  accumulate_requeued();
  time(Stage::cylinders, [&] { left_over_ = left_for_cylinders(*ledger_, fresh, waiting.due); });
}

/// What has lost its surface and found no other is segmented again once enough has come there.
void SurfaceUpdate::accumulate_requeued() {
  for (const geometry::VoxelKey key : std::exchange(ledger_->changes.requeued, {}))
    if (ledger_->is_pending(key)) state_.accumulated.push_back(key);
  put_in_order(state_.accumulated);
}

void SurfaceUpdate::count_categorized() {
  for (std::size_t scan = 0; scan < reports_.size(); ++scan)
    for (const geometry::VoxelKey key : appeared_[scan])
      if (const Index i = ledger_->window.find(key); i != occupancy::PointWindow::none)
        reports_[scan].categorized += ledger_->window[i].surface != 0;
}

void SurfaceUpdate::publish() {
  ScanReport& report = reports_.back();
  Stopwatch time(report);
  // Last, when the planes have all their points: cylinders never change them.
  time(Stage::cylinders, [&] { cylinders::update_cylinders(*ledger_, left_over_); });

  count_categorized();
  const surfaces::Changes& changes = ledger_->changes;
  report.born = list_of(changes.born);
  report.grown = list_of(changes.grown);
  report.shrunk = list_of(changes.shrunk);
  report.merged = list_of(changes.merged);
  report.gone = list_of(changes.gone);
  snapshot_ = time(Stage::derive, [&] { return upkeep::derive(state_, changes); });
}

std::vector<ScanReport> SurfaceUpdate::finish() {
  if (ledger_) {
    if (searched_ < appeared_.size()) find_surfaces();
    publish();
  }
  return std::move(reports_);
}

}  // namespace octosurf::mapper
