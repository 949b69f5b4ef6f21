#pragma once

#include "arrivals.hpp"
#include "checkpoints.hpp"
#include "pose_log.hpp"
#include "run_state.hpp"
#include "scan_feed.hpp"
#include "scan_keeper.hpp"

#include <cstddef>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {

/// One run of `octosurf map`, from the first scan to the files. If it ends early, the map so far is saved and
/// reported before the last line says why. If that fails, the line names the last complete checkpoint, which
/// is never overwritten by an incomplete map.
class MapRun {
 public:
  /// `keeper`: of the scans of `start` and of the new ones. `context`: input and the warnings so far.
  /// `begin`: of the whole run.
  MapRun(const MapOptions& options, Map start, ScanKeeper keeper, RunContext context,
         RunState::Clock::time_point begin);

  /// Finds surfaces in an octree, if any, or carries those of a resumed map over to it; then maps the scans.
  void run(const std::optional<std::filesystem::path>& octree, std::unique_ptr<ScanSource> source);

  using Finish = std::function<surfaces::Succeeded(Map& map, const std::vector<Eigen::Isometry3d>& poses)>;
  /// Maps all scans, or saves nothing. `finish`: before the map is saved; gets the poses of its scans.
  void rebuild(std::unique_ptr<ScanSource> source, const Finish& finish);

 private:
  void take_over(const std::filesystem::path& octree);
  void map_scans(std::unique_ptr<ScanSource> source);
  void insert_all(ScanFeed& feed);
  /// The next scan, prepared if it has arrived and there is a thread for it. In any thread, one at a time.
  std::optional<PreparedScan> next(ScanFeed& feed) const;
  void insert(std::span<const PreparedScan> scans);
  /// Mapper::drain, at the end or a pause of the input.
  void drain();
  void save(Saving saving);
  /// Saves as much as possible, then throws the last line.
  [[noreturn]] void end_early(const std::exception& failure);

  const MapOptions& options_;
  RunState run_;
  ScanKeeper keeper_;
  PoseLog poses_;
  Checkpoints checkpoints_;
  std::shared_ptr<const void> live_;  // destroyed before the mapper, which it uses
  Arrivals arrivals_;
  std::optional<double> last_stamp_s_;    // of the scans that were inserted
  bool saving_last_ = false;              // the last save has begun
  std::unique_ptr<std::byte[]> reserve_;  // freed when the run fails, because saving needs some memory
};

}  // namespace octosurf
