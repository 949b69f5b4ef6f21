#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::io {

// The scans that a map was built from, as `octosurf map --keep-scans` keeps them: a folder of PCDs like any
// other, `NNNNNN_STAMP.pcd`, by number from 0 and time stamp, s. VIEWPOINT is the pose with which it was
// mapped. A depth camera's points form one column, a lidar's one row, by which readers tell them apart. A map
// of n scans owns the first n; later files, of a run that was killed before it saved, are ignored or
// replaced.

/// The files of the first `scans` scans. Throws Error(data) if there are fewer.
std::vector<std::filesystem::path> kept_scans(const std::filesystem::path& folder, std::uint64_t scans);

/// Throws Error(usage) unless `folder` is not there, or is an empty folder.
void require_room_for_scans(const std::filesystem::path& folder);

/// Appends scans to such a folder.
class ScanWriter {
 public:
  /// Appends after the first `scans` scans in `folder`; later files are removed. Creates a missing folder.
  /// Throws Error(output), and Error(data) if one of them is missing.
  ScanWriter(std::filesystem::path folder, std::uint64_t scans);

  /// The next one in order. Throws Error(output).
  void add(const Scan& scan);

  /// Waits until the names of all that was added are on the disk, too. Throws Error(output).
  void finish();

 private:
  std::filesystem::path folder_;
  std::uint64_t next_;
};

}  // namespace octosurf::io
