#pragma once

#include <cstddef>

namespace octosurf::fuzz {

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
