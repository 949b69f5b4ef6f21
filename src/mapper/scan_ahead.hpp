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

/// What of a scan asks nothing of the map: its points by voxel, and what its rays touch.
struct TracedScan {
  sensing::VoxelScan voxels;
  occupancy::OccupancyMap::Touched touched;  ///< valid until the octree traces another scan
  ScanReport times;                          ///< only `stage_ms` and `total_ms`
};

/// Traces the scan that is expected next, from where it says that it was taken, in a thread of its own.
class ScanAhead {
 public:
  ScanAhead() = default;
  ScanAhead(const ScanAhead&) = delete;
  ScanAhead& operator=(const ScanAhead&) = delete;
  ~ScanAhead() { wait(); }

  /// trace(scan) gives a TracedScan. `scan` stays as it is until wait(). What is thrown is not passed on:
  /// whoever inserts the scan meets it again. Nor is it told that there is no thread to be had.
  template <class Trace>
  void start(const Scan& scan, Trace trace);
  void wait() noexcept {
    if (thread_.joinable()) thread_.join();
  }
  /// What start() was called for, if that was just this scan. After wait(); once.
  std::optional<TracedScan> take(const Scan& scan);

 private:
  Scan scan_;  // a copy, because the caller may have changed its own since
  std::optional<TracedScan> traced_;
  std::thread thread_;
};

/// Until the end of a block.
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
