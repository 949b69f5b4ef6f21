#pragma once

#include "occupancy/occupancy_map.hpp"
#include "sensing/downsample.hpp"

#include <exception>
#include <optional>
#include <thread>
#include <utility>

#include <octosurf/mapper.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::mapper {

/// Map-independent preprocessing of a scan: its points by voxel, and the voxels its rays touch.
struct TracedScan {
  sensing::VoxelScan voxels;
  occupancy::OccupancyMap::Touched touched;  ///< valid until the octree traces another scan
  ScanReport times;                          ///< only `stage_ms` and `total_ms`
};

/// Traces the expected next scan at its given pose in a background thread.
class ScanAhead {
 public:
  ScanAhead() = default;
  ScanAhead(const ScanAhead&) = delete;
  ScanAhead& operator=(const ScanAhead&) = delete;
  ~ScanAhead() { wait(); }

  /// trace(scan) returns a TracedScan. `scan` must not change until wait(). Exceptions are dropped, also if
  /// no thread can be started: the insertion of the scan then repeats the work and throws itself.
  template <class Trace>
  void start(const Scan& scan, Trace trace);
  void wait() noexcept {
    if (thread_.joinable()) thread_.join();
  }
  /// The result of start(), if it was called for this scan. Call after wait(), once.
  std::optional<TracedScan> take(const Scan& scan);

 private:
  Scan scan_;  // a copy, because the caller may change the original
  std::optional<TracedScan> traced_;
  std::thread thread_;
};

/// Waits at the end of a scope.
class WaitFor {
 public:
  explicit WaitFor(ScanAhead& ahead) : ahead_(ahead) {}
  WaitFor(const WaitFor&) = delete;
  WaitFor& operator=(const WaitFor&) = delete;
  ~WaitFor() { ahead_.wait(); }

 private:
  ScanAhead& ahead_;
};

template <class Trace>
void ScanAhead::start(const Scan& scan, Trace trace) {
  wait();
  traced_.reset();
  try {
    thread_ = std::thread([this, &scan, trace = std::move(trace)] {
      try {
        scan_ = scan;
        traced_ = trace(scan_);
      } catch (...) {
        traced_.reset();
      }
    });
  } catch (const std::exception&) {  // std::system_error or std::bad_alloc
  }
}

}  // namespace octosurf::mapper
