#pragma once

#include "backlog.hpp"
#include "checkpoints.hpp"
#include "io/map_file/past.hpp"
#include "parameter_options.hpp"
#include "pose_check.hpp"
#include "pose_log.hpp"
#include "run_statistics.hpp"
#include "scan_feed.hpp"
#include "scan_keeper.hpp"
#include "scene_log.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {

/// Options of `octosurf map`.
struct MapOptions {
  std::vector<std::string> inputs;
  std::string output, resume, report;         ///< stems of maps; file
  std::string keep_scans, write_poses, mcap;  ///< folder; files
  std::uint64_t max_memory = 0;               ///< bytes; 0: no limit
  ParameterOptions parameters;
  ScanSourceOptions source;
  ScanRange range;
  std::vector<double> viewpoint;             ///< of clouds without a pose: none, or three
  std::optional<PoseForm> pose_form;         ///< empty: as given, if they fit so
  double checkpoint_s = 60;                  ///< 0: never
  std::optional<unsigned short> serve_port;  ///< of this machine, to serve the map while it grows
  int threads = 1;
  std::size_t together = 16;  ///< maximum of scans mapped together: half a second of a camera's, 60 MB
  bool allow_clear = false;   ///< to those who are served
  bool realtime = false, again = false, forget_scans = false, force = false, show_parameters = false;
  bool strict = false;  ///< no map of scans that contradict one another
};

class LiveServer;

/// One run of `octosurf map`, from the first scan to the files.
///
/// If the run ends early (a bad scan, Ctrl-C, SIGTERM, a lost terminal, no memory, a full disk), the map so
/// far is saved, the report written and the summary printed before the last line reports it. If that fails,
/// the line names the last complete checkpoint, which is never overwritten by an incomplete map.
class MapRun {
 public:
  using Clock = std::chrono::steady_clock;

  /// `kept`: location of the scans of `start` and of the new ones. `context`: input and the warnings so far.
  /// `begin`: of the whole run.
  MapRun(const MapOptions& options, Map start, KeptScans kept, RunContext context, Clock::time_point begin);

  /// With `adopt` first detects surfaces in the octree, then maps the scans of `source`, if any.
  void run(bool adopt, std::unique_ptr<ScanSource> source);
  ~MapRun();

 private:
  void serve();
  void adopt_octree();
  /// ScanFeed's: sets the viewpoint of clouds without a pose, and skips scans that the map had when the run
  /// began. `alone`: there is one scan only, and no file of poses.
  std::function<bool(Scan&)> accepting(bool alone) const;
  void place(Scan& cloud, bool alone) const;
  /// Throws Error(data): nothing is written.
  [[noreturn]] void refuse(const std::string& what, const std::string& hint);
  /// Throws if poses fit far better in another form or unit, which would ruin the map: nothing is written.
  void require_sensible_poses();
  /// Throws if the run has mapped hardly any reading.
  void require_mapped();
  void map_scans(std::unique_ptr<ScanSource> source);
  void insert_all(ScanFeed& feed);
  /// --realtime: waits until the scan has arrived; if mapping has fallen behind, adds others that have.
  void wait_and_join(std::vector<PreparedScan>& scans, ScanFeed& feed);
  /// The next scan, prepared if it has arrived and there is a thread for it. In any thread, one at a time.
  std::optional<PreparedScan> next(ScanFeed& feed) const;
  void insert(std::span<const PreparedScan> scans);
  /// Mapper::drain, at the end or a pause of the input.
  void drain();
  void note(const Scan& scan, const ScanReport& report, double arrival_s, double done_s);
  /// Saves map and report, prints the summary.
  void finish();
  void require_agreement();
  /// Saves as much as possible, then throws the last line.
  [[noreturn]] void end_early(const std::exception& failure);
  void print_alignment() const;
  void wait_for(double arrival_s);
  void clear_as_asked();
  void checkpoint();
  void write_report();
  void print_summary() const;
  void print_dropped() const;
  bool all_saved() const { return checkpoints_.any() && checkpoints_.scans() == statistics_.scans(); }
  double arrival_of(const Scan& scan) const { return stamp_zero_s_ + scan.stamp_s; }
  double now_s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  const MapOptions& options_;
  Mapper mapper_;
  RunStatistics statistics_;
  RunContext context_;
  Clock::time_point begin_;
  Checkpoints checkpoints_;
  io::PastKeeper past_;
  ScanKeeper keeper_;
  PoseCheck pose_check_;
  PoseLog poses_;
  Backlog backlog_;  // --realtime
  SceneLog scene_;
  std::unique_ptr<std::byte[]> reserve_;  // freed when the run fails, because saving needs some memory
  bool changed_ = false;                  // the map, by this run
  bool finishing_ = false;
  bool near_sensor_ = false;            // warn_of_first_scan()
  bool posed_ = false;                  // poses come from elsewhere than the scans
  std::unique_ptr<LiveServer> server_;  // destroyed before the mapper, which it uses
  std::optional<double> last_stamp_s_;  // of the scans that were mapped
  double stamp_zero_s_ = 0;             // --realtime: a time stamp's arrival is stamp + stamp_zero_s_
};

}  // namespace octosurf
