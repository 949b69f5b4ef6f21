#pragma once

#include "mapper/run_statistics.hpp"
#include "parameter_options.hpp"
#include "scan_feed.hpp"

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {

/// What the user of `octosurf map` asked for.
struct MapOptions {
  std::vector<std::string> inputs;
  std::string output, resume, report;  ///< stems of maps; file
  ParameterOptions parameters;
  ScanSourceOptions source;
  ScanRange range;
  double checkpoint_s = 0;  ///< 0: never
  int threads = 1;
  bool realtime = false, force = false, show_parameters = false;
};

/// One run of `octosurf map`, from the first scan to the files.
///
/// Whatever ends the run early (a bad scan, Ctrl-C, SIGTERM), what was mapped until then is saved, the
/// report written and the summary printed before the Error says so.
class MapRun {
 public:
  using Clock = std::chrono::steady_clock;

  /// `context`: input and the warnings so far. `begin`: of the whole run.
  MapRun(const MapOptions& options, Map start, RunContext context, Clock::time_point begin);

  /// Surfaces of an octree that came without scans.
  void adopt_octree();
  void map_scans(std::unique_ptr<ScanSource> source);
  /// Saves map and report, prints the summary.
  void finish();

 private:
  void insert_all(ScanFeed& feed);
  void insert(const Scan& scan);
  /// Saves what there is, then throws.
  [[noreturn]] void end_early(const std::optional<Error>& failure);
  void wait_for(double arrival_s) const;
  void checkpoint();
  void write_report();
  void print_summary() const;
  void print_dropped() const;
  void warn_of_double_layers() const;
  double now_s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  const MapOptions& options_;
  Mapper mapper_;
  RunStatistics statistics_;
  RunContext context_;
  Clock::time_point begin_;
  bool changed_ = false;     // the map, by this run
  double saved_s_ = 0;       // when the last checkpoint was
  double stamp_zero_s_ = 0;  // --realtime: a time stamp's arrival is stamp + stamp_zero_s_
};

}  // namespace octosurf
