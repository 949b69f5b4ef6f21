#pragma once

#include <atomic>

#include <octosurf/error.hpp>

namespace octosurf::geometry {

/// True: the work of every mapper in the process ends with an Error as soon as it can, and its map stays as
/// it was before. A signal handler may set it.
inline std::atomic<bool> interruption{false};

/// In loops of more than some 100 ms, and where bad_alloc could be thrown, too: never after a commit began.
inline void end_if_interrupted() {
  if (interruption.load(std::memory_order_relaxed)) throw Error(Error::Kind::data, "", "interrupted");
}

}  // namespace octosurf::geometry
