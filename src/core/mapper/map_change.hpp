#pragma once

#include "alignment/alignment_state.hpp"
#include "mapper/adopt_surfaces.hpp"
#include "mapper/update_surfaces.hpp"
#include "sensing/downsample.hpp"
#include "surfaces/transaction.hpp"

#include <optional>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// One change of a map, all or nothing: by a scan, by several scans, or by another cause. Without commit()
/// nothing remains of it.
class MapChange {
 public:
  /// `effort`: of each update.
  MapChange(surfaces::MapState& state, const detection::Detector& detector, Effort effort, int threads)
      : state_(state),
        detector_(detector),
        effort_(effort),
        threads_(threads),
        alignment_(state),
        transaction_(state) {}

  /// Begins a scan whose octree is about to change. The report is valid until the next call.
  ScanReport& begin(ScanReport report = {});
  /// Step 3, after each change of the octree. `scan`: null if none caused it.
  void retract(const occupancy::OccupancyDelta& delta, const sensing::VoxelScan* scan = nullptr);
  /// Steps 4 to 8, for all points that appeared or became pending so far.
  void update();
  surfaces::Ledger& ledger() { return *ledger_; }

  /// update(), unless nothing has changed since the last one; then step 9. Keeps all changes, and publishes
  /// them.
  std::vector<ScanReport> commit();

 private:
  void count_categorized();

  surfaces::MapState& state_;
  const detection::Detector& detector_;
  Effort effort_;
  int threads_;
  alignment::AlignmentChange alignment_;
  surfaces::Transaction transaction_;
  std::vector<ScanReport> reports_;
  std::vector<std::vector<geometry::VoxelKey>> appeared_;  // of each report
  std::optional<surfaces::Ledger> ledger_;                 // since the octree's last change
  bool updated_ = true;
};

}  // namespace octosurf::mapper
