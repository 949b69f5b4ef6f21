#pragma once

#include "io/map_file/archived_scan.hpp"

#include <cstdint>
#include <filesystem>
#include <future>
#include <vector>

namespace octosurf::io {

// An archive of scans is a folder that holds, for every scan of a map in order, one file as archived_scan.hpp
// describes it: 000000.scan, 000001.scan, …, numbered as the map counts its scans. So a map of n scans has
// the first n files for its own. What stands behind them was left by a run that was killed before it could
// save: it does no harm and is replaced when the map is gone on with.

/// Scan `number` of the archive in `folder`.
std::filesystem::path archived_file(const std::filesystem::path& folder, std::uint64_t number);

/// The files of the first `scans` scans. Throws Error(data) naming the first that is missing.
std::vector<std::filesystem::path> archived_files(const std::filesystem::path& folder, std::uint64_t scans);

/// Throws Error(usage) unless a new archive can be made in `folder`: it is not there, or is a folder that is
/// empty or, with `force`, an archive; Error(output) if it is no folder.
void require_room_for_archive(const std::filesystem::path& folder, bool force);

/// Writes an archive beside the mapping: while a file is being written the next scan can be mapped.
class ScanArchiveWriter {
 public:
  /// Goes on behind the first `scans` scans of the archive in `folder`; what follows them there is removed.
  /// Makes the folder where it is not there. Throws Error(output), and Error(data) if one of them is missing.
  ScanArchiveWriter(std::filesystem::path folder, std::uint64_t scans);
  ScanArchiveWriter(const ScanArchiveWriter&) = delete;
  ScanArchiveWriter& operator=(const ScanArchiveWriter&) = delete;
  ~ScanArchiveWriter();

  /// A scan that was mapped, the next one in order. Throws Error(output) if the one before could not be
  /// written.
  void add(ArchivedHeader header, sensing::VoxelScan voxels);

  /// Waits until all that was added is on the disk. Throws Error(output), and is of no use after that.
  void finish();

  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
  std::uint64_t next_;
  std::future<void> writing_;
};

/// Begins the archive in `folder` with the first `scans` scans of another, which it shares with it where the
/// file system has links. Throws Error(output), Error(data).
void copy_archive(const std::filesystem::path& from, const std::filesystem::path& folder,
                  std::uint64_t scans);

}  // namespace octosurf::io
