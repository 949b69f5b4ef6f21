#pragma once

#include "run_state.hpp"
#include "scan_feed.hpp"

#include <memory>
#include <string>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf {

/// The scans of a run as they are inserted: in a selected range, and without those that the map holds.
class RunScans {
 public:
  /// Prints the source's notes. Throws Error(usage) if the range is empty.
  RunScans(RunState& run, std::unique_ptr<ScanSource> source);

  ScanFeed& feed() { return *feed_; }
  /// After the last scan: prints later notes, and keeps for the report what was skipped.
  void finish();

 private:
  /// ScanFeed's.
  bool accept(const Scan& scan);
  /// Throws Error(data) for a lidar's scan that reaches farther than one sees, unless max_range is given.
  void require_metres(const Scan& scan) const;
  /// Throws Error(data) for a pose that is no place.
  void require_near(const Scan& scan) const;

  RunState& run_;
  std::vector<std::string> notes_;   // printed
  std::vector<std::uint64_t> held_;  // fingerprints of the map's scans when the run began, ascending
  bool first_ = true;
  std::unique_ptr<ScanFeed> feed_;
};

}  // namespace octosurf
