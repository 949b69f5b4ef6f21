#include "mapper/surface_update.hpp"

#include "detection/cylinders.hpp"
#include "detection/detection.hpp"
#include "law/update_surfaces.hpp"
#include "mapper/stopwatch.hpp"
#include "upkeep/derive.hpp"
#include "upkeep/retract.hpp"
#include "upkeep/revise.hpp"

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

/// Of what is new, and of what the law has just looked at: cylinders that are there take both, new ones begin
/// in what planes do not explain.
detection::Detection::LeftOver left_for_cylinders(const surfaces::Ledger& ledger,
                                                  std::span<const geometry::VoxelKey> fresh,
                                                  std::span<const geometry::VoxelKey> refused) {
  if (!ledger.parameters.detection.detect_cylinders) return {};
  std::vector<geometry::VoxelKey> keys;
  std::set_union(fresh.begin(), fresh.end(), refused.begin(), refused.end(), std::back_inserter(keys));
  const auto pending = [&](std::span<const geometry::VoxelKey> from) {
    std::vector<Index> points;
    for (const geometry::VoxelKey key : from)
      if (const Index i = ledger.window.find(key); ledger.window[i].surface == 0) points.push_back(i);
    return points;
  };
  return detection::left_over_of(ledger, pending(keys), pending(refused));
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
  expansion_.emplace(*ledger_);
}

void SurfaceUpdate::retract(const sensing::VoxelScan& scan, const occupancy::OccupancyDelta& delta) {
  ScanReport& report = reports_.back();
  Stopwatch time(report);
  state_.points += delta.appeared.size();
  state_.points -= delta.vanished.size();
  report.appeared = delta.appeared.size();
  report.vanished = delta.vanished.size();
  renew_ledger();
  time(Stage::cylinders, [&] { detection::retract_cylinders(*ledger_, delta); });
  time(Stage::retract, [&] {
    upkeep::retract(*ledger_, delta);
    upkeep::accumulate_evidence(*ledger_, scan, delta.confirmed);
  });
  appeared_.back() = keys_of(delta.appeared);
}

void SurfaceUpdate::accumulate(std::vector<geometry::VoxelKey> keys) {
  keys.insert(keys.end(), ledger_->changes.requeued.begin(), ledger_->changes.requeued.end());
  keys.insert(keys.end(), state_.accumulated.begin(), state_.accumulated.end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  state_.accumulated = std::move(keys);
}

/// What is new and pending, and what retracting has made so.
void SurfaceUpdate::find_by_law(std::span<const Index> appeared) {
  std::vector<geometry::VoxelKey> fresh = ledger_->changes.requeued;
  for (const Index i : appeared) fresh.push_back(ledger_->window[i].key);
  std::sort(fresh.begin(), fresh.end());
  fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
  std::erase_if(fresh, [&](geometry::VoxelKey key) {
    const Index i = ledger_->window.find(key);
    return i == occupancy::PointWindow::none || ledger_->window[i].surface != 0;
  });
  law::LeftPending left =
      law::update_surfaces(*ledger_, state_.occupancy, std::move(state_.accumulated), fresh);
  left_over_ = left_for_cylinders(*ledger_, fresh, left.refused);
  state_.accumulated = std::move(left.waiting);
}

void SurfaceUpdate::find_surfaces(const ForeignSurfaces* foreign) {
  const std::vector<Index> appeared = indices_of(ledger_->window, std::span(appeared_).subspan(searched_));
  searched_ = appeared_.size();
  if (rules_ == Rules::stages) return find_by_stages(appeared, foreign);
  Stopwatch time(reports_.back());
  time(Stage::detect, [&] {
    if (foreign != nullptr) adopt_surfaces(*ledger_, appeared, *foreign);
    find_by_law(appeared);
  });
}

void SurfaceUpdate::find_by_stages(const std::vector<Index>& appeared, const ForeignSurfaces* foreign) {
  Stopwatch time(reports_.back());
  const std::vector<Index> left = time(Stage::add_inliers, [&] { return expansion_->add_inliers(appeared); });
  if (foreign != nullptr)
    time(Stage::detect, [&] { expansion_->adopt(adopt_surfaces(*ledger_, appeared, *foreign)); });
  time(Stage::expand, [&] { expansion_->expand(left); });
  time(Stage::detect, [&] {
    std::vector<geometry::VoxelKey> pending;
    for (const Index i : left)
      if (ledger_->window[i].surface == 0) pending.push_back(ledger_->window[i].key);
    accumulate(std::move(pending));
    ledger_->changes.requeued.clear();
    if (std::optional<detection::Detection> found = detection::detect(*ledger_, state_.accumulated)) {
      state_.accumulated.clear();
      left_over_ = std::move(found->left_over);
      expansion_->grow(found->born);
    }
  });
}

void SurfaceUpdate::count_categorized() {
  for (std::size_t scan = 0; scan < reports_.size(); ++scan)
    for (const geometry::VoxelKey key : appeared_[scan])
      if (const Index i = ledger_->window.find(key); i != occupancy::PointWindow::none)
        reports_[scan].categorized += ledger_->window[i].surface != 0;
}

void SurfaceUpdate::revise() {
  ScanReport& report = reports_.back();
  Stopwatch time(report);
  time(Stage::revise, [&] {
    if (rules_ == Rules::stages) {
      if (state_.parameters.aligned()) expansion_->rejoin();
      upkeep::refit(*ledger_);
    }
    accumulate({});
  });
  // Last, when the planes have all their points: cylinders never change them.
  time(Stage::cylinders, [&] { detection::update_cylinders(*ledger_, left_over_); });

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
    revise();
  }
  return std::move(reports_);
}

}  // namespace octosurf::mapper
