#pragma once

#include "io/map_file/scan_archive.hpp"
#include "sensing/noise_model.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {

/// Keeps the scans of a run in an archive, if it is to (`--keep-scans`).
///
/// A scan is added only after it was mapped, and finish() is called before the map is saved: so every saved
/// map finds all its scans in the archive it names, whenever the power fails.
class ScanKeeper {
 public:
  /// Goes on with the archive of the mapper's map; does nothing if kept.folder is empty. From now on the
  /// mapper rounds its scans. Throws Error(output), Error(data).
  ScanKeeper(KeptScans kept, Mapper& mapper);

  /// Both throw Error(output). Then the archive misses a scan, and the map that is saved afterwards names
  /// none: a warning says so.
  void add(const Scan& scan, const ScanReport& report);
  void finish();

  /// What to save with the map.
  const KeptScans& kept() const { return kept_; }

 private:
  template <class Work>
  void keep(const Work& work);

  KeptScans kept_;
  const Mapper& mapper_;
  sensing::NoiseModel::Histogram noise_{};  // of all scans so far
  std::unique_ptr<io::ScanArchiveWriter> archive_;
};

/// The archive that a run is to keep its scans in.
struct KeepingWish {
  std::string folder;     ///< of --keep-scans, or empty
  bool in_place = false;  ///< the map that is gone on with is the one that is written
  bool force = false;
};

/// For a run that goes on with `map`, whose scans are in `before`; what the user should know goes to
/// `warnings`.
/// 1. A map goes on with its archive by itself where it is written over. Written elsewhere, it would share it
///    with the map it began as, so it gets one only by a wish, with links to what is there.
/// 2. A map has either all its scans in an archive or none. Throws Error(usage) where a wish goes against it.
KeptScans choose_archive(const KeepingWish& wish, const Map& map, const KeptScans& before,
                         std::vector<std::string>& warnings);

}  // namespace octosurf
