#pragma once

#include "io/scan_archive.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {

/// Keeps the scans of a run in an archive, if it is to (`--keep-scans`).
///
/// A scan is added only after it was mapped, and finish() is called before the map is saved: so every saved map
/// finds all its scans in the archive it names, whenever the power fails.
class ScanKeeper {
 public:
  /// Goes on with the archive of `map`, none if kept.folder is empty. Throws Error(output), Error(data).
  ScanKeeper(KeptScans kept, const Map& map);

  /// Both throw Error(output). Then the archive misses a scan: the map that is saved afterwards names none.
  void add(const Scan& scan, const ScanReport& report, const VoxelScan& voxels);
  void finish();

  /// What to save with the map.
  const KeptScans& kept() const { return kept_; }

 private:
  KeptScans kept_;
  double resolution_;
  std::unique_ptr<ScanArchiveWriter> archive_;
};

/// The archive that a run is to keep its scans in.
struct KeepingWish {
  std::string folder;     ///< of --keep-scans, or empty
  bool in_place = false;  ///< the map that is gone on with is the one that is written
  bool force = false;
};

/// For a run that goes on with `map`, whose scans are in `before`; what the user should know goes to `warnings`.
/// 1. A map goes on with its archive by itself where it is written over. Written elsewhere, it would share it
///    with the map it began as, so it gets one only by a wish, with links to what is there.
/// 2. A map has either all its scans in an archive or none. Throws Error(usage) where a wish goes against it.
KeptScans choose_archive(const KeepingWish& wish, const Map& map, const KeptScans& before,
                         std::vector<std::string>& warnings);

}  // namespace octosurf
