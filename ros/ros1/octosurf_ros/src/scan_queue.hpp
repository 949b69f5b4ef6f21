#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace octosurf::ros1 {

/// A cloud or a depth image as it came.
struct WaitingScan {
  std::string topic;
  bool is_depth = false;
  std::shared_ptr<const std::string> bytes;
};

/// Scans on their way from the subscribers' threads to the mapping one. Holds so many at most: a robot is
/// better served by a map of now than by one of some time ago, so the oldest gives way.
class ScanQueue {
 public:
  struct Counts {
    std::uint64_t received = 0, dropped = 0;
    std::size_t waiting = 0;
  };

  /// How many were dropped for it.
  std::size_t push(WaitingScan scan, std::size_t most);
  /// Waits for one; nothing once it is closed.
  std::optional<WaitingScan> pop();
  void close();
  Counts counts() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<WaitingScan> scans_;
  Counts counts_;
  bool closed_ = false;
};

}  // namespace octosurf::ros1
