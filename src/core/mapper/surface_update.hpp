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

/// The surface stages of a scan or of several scans (docs/design.md §4, from step 3 on). Times are added to
/// the last report.
class SurfaceUpdate {
 public:
  /// `all`: process everything due, not only a scan's budget. Throws Error(usage) if the program does not
  /// link the map's detector.
  SurfaceUpdate(surfaces::MapState& state, bool all, int threads)
      : state_(state), detector_(detection::detector_of(state.parameters)), all_(all), threads_(threads) {}

  bool empty() const { return reports_.empty(); }
  /// Adds a scan's report so far; its stages continue there. Valid until the next call.
  ScanReport& add(ScanReport report);

  /// Step 3 for the last report's scan: must run before the next scan, which builds on it.
  void retract(const sensing::VoxelScan& scan, const occupancy::OccupancyDelta& delta);

  /// Whether surfaces were already searched for in some scan's points.
  bool searched() const { return searched_ > 0; }
  /// Steps 4 to 7, for the scans in which surfaces were not searched for yet. `foreign`: another map's
  /// surfaces of the appeared points.
  void find_surfaces(const ForeignSurfaces* foreign = nullptr);

  /// The rest of steps 4 to 7, then 8 and 9.
  std::vector<ScanReport> finish();
  /// To be published; after finish(). Null if no scan went into the octree.
  const std::shared_ptr<const Snapshot>& snapshot() const { return snapshot_; }

 private:
  void renew_ledger();
  std::vector<geometry::VoxelKey> pending_of(std::vector<geometry::VoxelKey> keys) const;
  std::vector<geometry::VoxelKey> take_fresh(std::span<const occupancy::PointWindow::Index> appeared);
  void bring_outlines_up_to_date();
  void expand_beside(std::span<const geometry::VoxelKey> keys, std::vector<detection::Assignment>& gained);
  /// `looked_at`: number of `gained` assignments that existed at detection.
  void revise(std::vector<detection::Assignment>& gained, std::size_t looked_at);
  void accumulate(std::span<const geometry::VoxelKey> keys);
  void count_categorized();
  void publish();

  surfaces::MapState& state_;
  const detection::Detector& detector_;
  bool all_;
  int threads_;
  std::vector<ScanReport> reports_;
  std::vector<std::vector<geometry::VoxelKey>> appeared_;  // of each report; empty if the scan was set aside
  std::size_t searched_ = 0;                               // number of these already searched for surfaces
  std::optional<surfaces::Ledger> ledger_;                 // of the last applied scan
  cylinders::LeftOver left_over_;                          // likewise
  std::shared_ptr<const Snapshot> snapshot_;
};

}  // namespace octosurf::mapper
