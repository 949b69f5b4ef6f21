#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::io {

/// OctoMap's binary scan graph (`.graph`): posed scans; the edges between them are ignored. OctoMap's own
/// reader does not check counts; here all are checked against the size of the file before any allocation.
class ScanGraphFile {
 public:
  /// Finds the scans in the file. Throws Error(data) unless its structure is that of a graph, to
  /// the last byte. O(scans).
  explicit ScanGraphFile(std::filesystem::path file);

  /// Whether the constructor would accept the file; never throws.
  static bool matches(const std::filesystem::path& file) noexcept;

  std::size_t size() const { return offsets_.size(); }

  /// Scan `index` < size(): points in the sensor's frame, the file's pose (unchecked), sensor lidar. Throws
  /// Error(data) if the file cannot be read any more.
  Scan read(std::size_t index) const;

 private:
  std::filesystem::path file_;
  std::vector<std::uint64_t> offsets_;  ///< of each scan's point count
};

}  // namespace octosurf::io
