#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::io {

// The scans that a map was built from, as `octosurf map --keep-scans` keeps them: a folder of PCDs like any
// other, `NNNNNN_STAMP.pcd`: the scan's number as the map counts scans, from 0, and its time stamp, s.
// VIEWPOINT is the pose with which it was mapped; points are the scan's, in its order, so that its noise can
// be estimated again. A depth camera's points form one column, a lidar's one row, by which readers tell
// them apart (scan_source.hpp). A map of n scans owns the first n. Later files come from
// a run that was killed before it saved: they are ignored, and replaced when the map is resumed.

/// The files of the first `scans` scans. Throws Error(data) with the number of the first that is missing.
std::vector<std::filesystem::path> kept_scans(const std::filesystem::path& folder, std::uint64_t scans);

/// Throws Error(usage) unless `folder` is not there, or is an empty folder.
void require_room_for_scans(const std::filesystem::path& folder);

/// Writes scans beside the mapping: while a file is being written the next scan can be mapped.
class ScanWriter {
 public:
  /// Appends after the first `scans` scans in `folder`; later files are removed. Creates a missing folder.
  /// Throws Error(output), and Error(data) if one of them is missing.
  ScanWriter(std::filesystem::path folder, std::uint64_t scans);
  ~ScanWriter();

  /// The next one in order. Throws Error(output) if the one before could not be written.
  void add(Scan scan);

  /// Waits until all that was added is on the disk. Throws Error(output), and is of no use after that.
  void finish();

 private:
  std::filesystem::path folder_;
  std::uint64_t next_;
  std::future<void> writing_;
};

}  // namespace octosurf::io
