#pragma once

#include "alignment/alignment_state.hpp"
#include "detection/detector.hpp"
#include "occupancy/ray_tracer.hpp"
#include "sensing/downsample.hpp"

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// The points that are segmented: of the waiting ones those that have their turn in a scan (waiting.hpp), or
/// all of them.
enum class Effort { turn, all };

/// Steps 4 to 8 of a scan (docs/design.md §4), for every change of the octree: finds the surfaces of the
/// ledger's unprocessed points. Counts and times are added to the report. Cost follows the unprocessed and
/// waiting points.
void update_surfaces(surfaces::Ledger& ledger, const detection::Detector& detector, Effort effort,
                     int threads, ScanReport& report);

/// One change of a map, all or nothing: by a scan, by several scans, or by another cause. From construction
/// on the previous state is recorded, at a cost that follows the writes: copies of the octree's chunks and of
/// the surfaces' planes and sums, not of their points; and of the queue. Without commit() the destructor
/// restores it. One at a time for a map.
class MapChange {
 public:
  /// `effort`: of each update.
  MapChange(surfaces::MapState& state, const detection::Detector& detector, Effort effort, int threads);
  MapChange(const MapChange&) = delete;
  MapChange& operator=(const MapChange&) = delete;
  ~MapChange();

  /// Begins a scan, or another cause. The report is valid until the next call.
  ScanReport& begin(ScanReport report = {});
  /// Steps 2 and 3 of the scan, seen from the report's pose. `shared`: the common errors of its readings.
  void insert(const Scan& scan, const sensing::VoxelScan& voxels, const occupancy::TouchedVoxels& touched,
              std::span<const sensing::SharedVariance> shared);
  /// Step 3, after the octree has changed. `scan`: null if none caused it.
  void retract(const occupancy::OccupancyDelta& delta, const sensing::VoxelScan* scan = nullptr);
  /// Steps 4 to 8, for all points that appeared or became pending so far.
  void update();
  /// Of the octree as it is; valid until the next insert() or retract().
  surfaces::Ledger& ledger();

  /// update(), if something was retracted since the last one; then step 9. Keeps all changes, and publishes
  /// them.
  std::vector<ScanReport> commit();

 private:
  /// State saved by copy.
  struct Records {
    explicit Records(const surfaces::MapState& state);
    void put_back(surfaces::MapState& state) noexcept;

    sensing::NoiseModel noise;
    alignment::AlignmentState alignment;
    RemovalLog removals;
    surfaces::PendingQueue queue;
    std::size_t points, held;
    std::uint64_t scans, revision;
    Eigen::Vector3d sensors_up;
  };
  std::shared_ptr<const surfaces::Published::State> next_state();

  surfaces::MapState& state_;
  const detection::Detector& detector_;
  Effort effort_;
  int threads_;
  Records before_;
  std::vector<ScanReport> reports_;
  std::vector<std::vector<geometry::VoxelKey>> appeared_;  // of each report
  std::optional<surfaces::Ledger> ledger_;                 // since the octree's last change
  bool updated_ = true, committed_ = false;
};

}  // namespace octosurf::mapper
