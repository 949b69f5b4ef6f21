#pragma once

#include "memory/page_file.hpp"

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <thread>

namespace octosurf::memory {

/// The most memory that the process has had, bytes.
std::size_t peak_of_process();

/// Keeps the process within a number of bytes while a map that owns this lives, as far as the map can: what
/// grows with it is in a page file, and leaves the process when that comes near the limit. What is needed
/// comes back by itself, so results do not depend on it, nor on when it happens.
class MemoryLimit {
 public:
  /// The file is in `folder`. Throws Error(output).
  MemoryLimit(std::size_t bytes, const std::filesystem::path& folder);

  /// Shared with views of the octree, which may outlive the map.
  const std::shared_ptr<PageFile>& pages() const { return pages_; }
  std::size_t limit() const { return limit_; }  ///< bytes
  /// The most that the process had since this was made, bytes: over the limit where what cannot leave takes
  /// more, or more came back at once than left.
  std::size_t peak() const;
  /// A limit within which nothing would have had to leave.
  std::size_t enough() const { return (kept_ + unseen + pages_->used()) / 15 * 16; }

 private:
  /// Bytes: within the 2 ms between two looks of watch(), two threads fault in some 2 GB/s · 2 ms.
  static constexpr std::size_t unseen = 4 << 20;
  void watch(const std::stop_token& stop);

  std::size_t limit_;
  std::shared_ptr<PageFile> pages_;
  std::size_t peak_before_;                       // of the process
  std::atomic<std::size_t> seen_ = 0, kept_ = 0;  // the most that watch() saw, of that what cannot leave
  std::jthread watcher_;
};

}  // namespace octosurf::memory
