#pragma once

#include "middleware.hpp"

#include <chrono>
#include <cstddef>
#include <deque>
#include <optional>

namespace octosurf::node {

/// A queue of received scans with a limit in bytes: beyond it the oldest are dropped, so that mapping stays
/// near the robot's current place. Not thread-safe.
class ScanQueue {
 public:
  struct Item {
    RawMessage message;
    std::chrono::steady_clock::time_point came;
  };

  explicit ScanQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Returns how many made way; a message that is larger than all the queue is one of them.
  std::size_t push(Item item) {
    bytes_ += item.message.bytes.size();
    items_.push_back(std::move(item));
    std::size_t dropped = 0;
    for (; bytes_ > most_bytes_; ++dropped) pop();
    return dropped;
  }

  std::optional<Item> pop() {
    if (items_.empty()) return std::nullopt;
    std::optional<Item> first = std::move(items_.front());
    items_.pop_front();
    bytes_ -= first->message.bytes.size();
    return first;
  }

  std::size_t size() const { return items_.size(); }

 private:
  std::size_t most_bytes_, bytes_ = 0;
  std::deque<Item> items_;
};

}  // namespace octosurf::node
