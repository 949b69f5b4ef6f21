#include "mapper/map_change.hpp"

#include "cylinders/cylinders.hpp"
#include "mapper/stopwatch.hpp"
#include "update/derive.hpp"
#include "update/retract.hpp"

#include <utility>

namespace octosurf::mapper {

ScanReport& MapChange::begin(ScanReport report) {
  appeared_.emplace_back();
  return reports_.emplace_back(std::move(report));
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
  ledger_.emplace(state_, std::move(so_far));
  for (const occupancy::VoxelPoint& p : delta.appeared) appeared_.back().push_back(p.key);
  ledger_->changes.unprocessed.insert(ledger_->changes.unprocessed.end(), appeared_.back().begin(),
                                      appeared_.back().end());
  time(Stage::cylinders, [&] { cylinders::retract_cylinders(*ledger_, delta); });
  time(Stage::retract, [&] {
    update::retract(*ledger_, delta);
    if (scan != nullptr) update::observe_again(*ledger_, *scan, delta.confirmed);
  });
  updated_ = false;
}

void MapChange::update() {
  update_surfaces(*ledger_, detector_, effort_, reports_.back());
  updated_ = true;
}

void MapChange::count_categorized() {
  for (std::size_t scan = 0; scan < reports_.size(); ++scan)
    for (const geometry::VoxelKey key : appeared_[scan])
      if (const PointId i = ledger_->window.find(key); i != PointId::none)
        reports_[scan].categorized += ledger_->window[i].surface != 0;
}

std::vector<ScanReport> MapChange::commit() {
  std::shared_ptr<const surfaces::Published::State> snapshot;
  if (ledger_) {
    if (!updated_) update();
    count_categorized();
    const surfaces::Changes& changes = ledger_->changes;
    ScanReport& report = reports_.back();
    report.born.assign(changes.born.begin(), changes.born.end());
    report.grown.assign(changes.grown.begin(), changes.grown.end());
    report.shrunk.assign(changes.shrunk.begin(), changes.shrunk.end());
    report.merged.assign(changes.merged.begin(), changes.merged.end());
    report.gone.assign(changes.gone.begin(), changes.gone.end());
    snapshot = Stopwatch(report)(
        Stage::derive, [&] { return update::derive(state_, changes, detector_.as_in_paper(), threads_); });
  }
  transaction_.commit(std::move(snapshot));
  alignment_.commit();
  return std::move(reports_);
}

}  // namespace octosurf::mapper
