#pragma once

#include "io/kept_scans.hpp"
#include "run_statistics.hpp"

#include <filesystem>
#include <memory>
#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// Keeps the scans of a run in a folder, if it is to (`--keep-scans`): each after it was mapped, and saved
/// before the map, which so finds all its scans whenever the power fails.
class ScanKeeper {
 public:
  /// Goes on behind the scans of the map; does nothing if kept.folder is empty. `there`: all scans are in the
  /// folder, and only their poses are new. Throws Error(output), Error(data).
  explicit ScanKeeper(KeptScans kept, bool there = false);

  /// Both throw Error(output). Then the folder misses a scan, and the map that is saved afterwards names
  /// none: a warning says so.
  void add(Scan scan, const Eigen::Isometry3d& T_map_sensor);
  void save();

  /// What to save with the map.
  const KeptScans& kept() const { return kept_; }
  /// Empty: it has written none.
  std::filesystem::path folder_written() const { return writer_ ? kept_.folder : ""; }

 private:
  template <class Work>
  void keep(const Work& work);

  KeptScans kept_;
  std::unique_ptr<io::ScanWriter> writer_;
};

/// Where a run keeps its scans that begins with `map`, whose scans are in `before`: all in a folder, or none.
/// `wish`: --keep-scans, or empty. Throws Error(usage) where that cannot be.
KeptScans choose_folder(const std::string& wish, bool in_place, const Map& map, const KeptScans& before,
                        RunContext& context);

}  // namespace octosurf
