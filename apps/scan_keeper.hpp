#pragma once

#include "io/kept_scans.hpp"
#include "run_observer.hpp"

#include <memory>
#include <string>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf {

/// Keeps the scans of a run in a folder, if it is to (`--keep-scans`).
///
/// A scan is added only after it was mapped, and this is saved before the map: so every saved map finds all
/// its scans in the folder it names, whenever the power fails.
class ScanKeeper : public RunObserver {
 public:
  /// Goes on behind the scans of the map; does nothing if kept.folder is empty. Throws Error(output),
  /// Error(data).
  explicit ScanKeeper(KeptScans kept);

  /// Both throw Error(output). Then the folder misses a scan, and the map that is saved afterwards names
  /// none: a warning says so.
  void after(const InsertedScan& inserted) override;
  void save(Saving) override;

  /// What to save with the map.
  const KeptScans& kept() const { return kept_; }

 private:
  template <class Work>
  void keep(const Work& work);

  KeptScans kept_;
  std::unique_ptr<io::ScanWriter> writer_;
};

/// Where a run is to keep its scans.
struct KeepingWish {
  std::string folder;     ///< of --keep-scans, or empty
  bool in_place = false;  ///< the map that is gone on with is the one that is written
  bool force = false;
};

/// For a run that resumes `map`, whose scans are in `before`; what the user should know goes to
/// `warnings`.
/// 1. A resumed map keeps its folder by itself where it is written over. Written elsewhere, it would share it
///    with the map it began as, so it gets one only by a wish, with links to what is there.
/// 2. A map has either all its scans in a folder or none. Throws Error(usage) where a wish goes against it.
KeptScans choose_folder(const KeepingWish& wish, const Map& map, const KeptScans& before,
                        std::vector<std::string>& warnings);

}  // namespace octosurf
