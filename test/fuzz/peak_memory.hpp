#pragma once

#include <cstddef>

namespace octosurf::fuzz {

/// A reader may take this much memory: so much whatever the file, and so many times the file.
inline constexpr std::size_t free_bytes = std::size_t{64} << 20, bytes_per_file_byte = 8;

/// Raises `peak` to the most memory that operator new gave out while one lived, beyond what it had at the
/// beginning; not at all in programs that do not link counted_new.cpp.
class PeakMemory {
 public:
  explicit PeakMemory(std::size_t& peak);
  PeakMemory(const PeakMemory&) = delete;
  PeakMemory& operator=(const PeakMemory&) = delete;
  ~PeakMemory();

 private:
  std::size_t& peak_;
  std::size_t before_ = 0;
};

}  // namespace octosurf::fuzz
