#pragma once

#include "cylinders/left_over.hpp"
#include "detection/detector.hpp"
#include "mapper/adopt_surfaces.hpp"
#include "sensing/downsample.hpp"
#include "surfaces/ledger.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// What scans that go into the octree, one or several, ask of the surfaces: docs/design.md §4, from step 3
/// on. Each stage's time goes to the last report.
class SurfaceUpdate {
 public:
  /// `all`: of what is due, not only as much as a scan's budget allows. Throws Error(usage) if the program
  /// does not link the map's detector.
  SurfaceUpdate(surfaces::MapState& state, bool all, int threads)
      : state_(state), detector_(detection::detector_of(state.parameters)), all_(all), threads_(threads) {}

  bool empty() const { return reports_.empty(); }
  /// A scan's, with what is known so far; where its stages go on. Valid until the next.
  ScanReport& add(ScanReport report);

  /// Step 3, of the last report's scan: what its delta asks at once, because the next scan builds on it.
  void retract(const sensing::VoxelScan& scan, const occupancy::OccupancyDelta& delta);

  /// Surfaces were looked for in some scan's points already.
  bool searched() const { return searched_ > 0; }
  /// Steps 4 to 7, for the scans in which surfaces have not been looked for. `foreign`: those that another
  /// map has on what appeared.
  void find_surfaces(const ForeignSurfaces* foreign = nullptr);

  /// What is left of steps 4 to 7, and 8 and 9.
  std::vector<ScanReport> finish();
  /// To be published; after finish(). Null if no scan went into the octree.
  const std::shared_ptr<const Snapshot>& snapshot() const { return snapshot_; }

 private:
  void renew_ledger();
  std::vector<geometry::VoxelKey> pending_of(std::vector<geometry::VoxelKey> keys) const;
  std::vector<geometry::VoxelKey> take_fresh(std::span<const occupancy::PointWindow::Index> appeared);
  void bring_outlines_up_to_date();
  void expand_beside(std::span<const geometry::VoxelKey> keys, std::vector<detection::Assignment>& gained);
  /// `looked_at`: of `gained`, what was there when surfaces were detected.
  void revise(std::vector<detection::Assignment>& gained, std::size_t looked_at);
  void accumulate(std::span<const geometry::VoxelKey> keys);
  void count_categorized();
  void publish();

  surfaces::MapState& state_;
  const detection::Detector& detector_;
  bool all_;
  int threads_;
  std::vector<ScanReport> reports_;
  std::vector<std::vector<geometry::VoxelKey>> appeared_;  // of each report; none if the scan was set aside
  std::size_t searched_ = 0;                               // of these, in which surfaces were looked for
  std::optional<surfaces::Ledger> ledger_;                 // of the scan last applied
  cylinders::LeftOver left_over_;                          // likewise
  std::shared_ptr<const Snapshot> snapshot_;
};

}  // namespace octosurf::mapper
