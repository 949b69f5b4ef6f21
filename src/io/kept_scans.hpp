#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::io {

// The scans that a map was built from, as `octosurf map --keep-scans` keeps them: a folder of PCDs like any
// other, `NNNNNN_STAMP.pcd`, by number from 0 and time stamp, s. VIEWPOINT is the pose with which it was
// mapped. A depth camera's points form one column, a lidar's one row, by which readers tell them apart. A map
// of n scans owns the first n, and knows their files by marks. Later ones, of a run that was killed before it
// saved, or of another map, are ignored, and set aside where others come.

/// The files of the first `scans` scans. Throws Error(data) if there are fewer, or if one has not its mark,
/// where there are `marks`.
std::vector<std::filesystem::path> kept_scans(const std::filesystem::path& folder, std::uint64_t scans,
                                              std::span<const std::uint32_t> marks = {});

/// Throws Error(usage) unless `folder` is not there, or is an empty folder.
void require_room_for_scans(const std::filesystem::path& folder);

/// Appends scans to such a folder.
class ScanWriter {
 public:
  /// Appends after the first `scans` scans in `folder`, whose `marks` the map has, or none. Creates a missing
  /// folder. Throws Error(output), and Error(data) as kept_scans().
  ScanWriter(std::filesystem::path folder, std::uint64_t scans, std::vector<std::uint32_t> marks = {});

  /// The next one in order. Later files are set aside, unless the first of them is the same: returns a
  /// warning that says so, else an empty one. Throws Error(output).
  std::string add(const Scan& scan);
  const std::vector<std::uint32_t>& marks() const { return marks_; }  ///< of all scans so far

  /// Waits until the names of all that was added are on the disk, too. Throws Error(output).
  void finish();

 private:
  std::string set_aside_later();

  std::filesystem::path folder_;
  std::vector<std::uint32_t> marks_;
  std::vector<std::filesystem::path> later_;
};

}  // namespace octosurf::io
