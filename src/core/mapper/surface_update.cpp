#include "mapper/surface_update.hpp"

#include "cylinders/cylinders.hpp"
#include "detection/write_surfaces.hpp"
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
using detection::Assignment;

/// Of the points that still exist.
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

/// From new points and those just segmented: existing cylinders take both, new ones begin in segmented points
/// that no plane explains.
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

/// Continues from the previous scan, with a window on the current octree.
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

/// New pending points, and those that retraction made pending.
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
  if (detector_.outlines_inliers_alone()) time(Stage::derive, [&] { bring_outlines_up_to_date(); });
  if (foreign != nullptr) time(Stage::detect, [&] { adopt_surfaces(*ledger_, appeared, *foreign); });
  const std::vector<geometry::VoxelKey> fresh = take_fresh(appeared);
  const SurfaceId first_new = state_.surfaces.next_id();
  const std::size_t added = time(Stage::add_inliers, [&] {
    const std::vector<Assignment> inliers = detector_.add_inliers(*ledger_, fresh);
    detection::assign(*ledger_, inliers);
    return inliers.size();
  });
  std::vector<Assignment> gained =
      time(Stage::expand, [&] { return detector_.expand(*ledger_, pending_of(fresh)); });
  detection::Due due;
  std::optional<detection::FoundPlanes> found = time(Stage::detect, [&] {
    due = detector_.due(*ledger_, state_.occupancy, std::move(state_.queue), pending_of(fresh), all_, gained);
    detection::assign(*ledger_, gained);
    return detector_.detect(*ledger_, state_.occupancy, due.points, gained);
  });
  std::vector<geometry::VoxelKey> explained, still_new;
  const std::size_t looked_at = gained.size();
  if (found) {
    time(Stage::detect, [&] { write_surfaces(*ledger_, *found, detection::Planes::touched); });
    time(Stage::expand, [&] { expand_beside(found->beside, gained); });
    explained = detection::newly_explained(*found);
    still_new = std::move(found->still_new);
    found.reset();  // revising replaces it
  }
  ScanReport& report = reports_.back();
  report.added += added;
  for (const Assignment& assignment : gained) report.expanded += assignment.surface < first_new;
  for (const geometry::VoxelKey key : explained)
    report.detected += ledger_->window[ledger_->window.find(key)].surface < first_new;
  time(Stage::revise, [&] { revise(gained, looked_at); });
  report.waiting = due.waiting;
  state_.queue = std::move(due.left);
  accumulate(still_new);
  accumulate(std::exchange(ledger_->changes.requeued, {}));  // once enough points are there
  put_in_order(state_.queue.fresh);
  // A thin pole lies in blocks without a plane.
  due.points.insert(due.points.end(), due.unplanar.begin(), due.unplanar.end());
  put_in_order(due.points);
  time(Stage::cylinders, [&] { left_over_ = left_for_cylinders(*ledger_, fresh, due.points); });
}

void SurfaceUpdate::bring_outlines_up_to_date() {
  for (const SurfaceId id : ledger_->changes.touched())
    if (surfaces::SurfaceModel& surface = *ledger_->find(id); surface.polygons_stale())
      surface.derive(state_.parameters.max_hole_size());
}

/// Expands into pending points beside these, which new or revised planes have taken.
void SurfaceUpdate::expand_beside(std::span<const geometry::VoxelKey> keys, std::vector<Assignment>& gained) {
  const std::vector<Assignment> more = detector_.expand(*ledger_, detection::pending_beside(*ledger_, keys));
  detection::assign(*ledger_, more);
  gained.insert(gained.end(), more.begin(), more.end());
}

/// Segments surfaces again whose size has changed. Refits the planes of those that have grown since their
/// last fit, and of those that lost points or were seen better, with an unchanged neighbourhood.
void SurfaceUpdate::revise(std::vector<Assignment>& gained, std::size_t looked_at) {
  surfaces::Changes& changes = ledger_->changes;
  std::set<SurfaceId> changed = changes.touched();
  std::erase_if(changed, [&](SurfaceId id) { return !ledger_->find(id)->size_has_changed(); });
  const auto found = detector_.revise(*ledger_, state_.occupancy, changed);
  for (const SurfaceId id : changed) ledger_->find(id)->set_checked();
  if (found) {
    write_surfaces(*ledger_, *found, detection::Planes::touched);
    expand_beside(found->beside, gained);
  }
  // Where expanded surfaces have since touched others that may be the same plane.
  std::vector<Assignment> since;
  for (const Assignment& assignment : std::span(gained).subspan(looked_at))
    if (const SurfaceId now = ledger_->window[assignment.point].surface; now != 0)
      since.push_back({assignment.point, now});
  if (const auto met = detector_.detect(*ledger_, state_.occupancy, {}, since))
    write_surfaces(*ledger_, *met, detection::Planes::touched);
  std::set<SurfaceId> grown, unfitted = changes.touched();
  for (const Assignment& assignment : gained) grown.insert(assignment.surface);
  std::erase_if(unfitted, [&](SurfaceId id) { return changes.refitted.contains(id) && !grown.contains(id); });
  for (const auto& [id, plane] : detector_.fit(*ledger_, unfitted)) {
    surfaces::SurfaceModel& surface = *ledger_->find(id);
    surface.set_plane(plane);
    surface.rehash_if_tilted();
  }
}

void SurfaceUpdate::accumulate(std::span<const geometry::VoxelKey> keys) {
  for (const geometry::VoxelKey key : keys)
    if (ledger_->is_pending(key)) state_.queue.fresh.push_back(key);
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
  // Last, when all points of planes are assigned: cylinders never change planes.
  time(Stage::cylinders, [&] { cylinders::update_cylinders(*ledger_, left_over_); });

  count_categorized();
  const surfaces::Changes& changes = ledger_->changes;
  report.born = list_of(changes.born);
  report.grown = list_of(changes.grown);
  report.shrunk = list_of(changes.shrunk);
  report.merged = list_of(changes.merged);
  report.gone = list_of(changes.gone);
  snapshot_ = time(Stage::derive, [&] {
    return upkeep::derive(state_, changes, detector_.outlines_inliers_alone(), threads_);
  });
}

std::vector<ScanReport> SurfaceUpdate::finish() {
  if (ledger_) {
    if (searched_ < appeared_.size()) find_surfaces();
    publish();
  }
  return std::move(reports_);
}

}  // namespace octosurf::mapper
