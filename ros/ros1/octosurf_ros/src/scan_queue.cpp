#include "scan_queue.hpp"

#include <utility>

namespace octosurf::ros1 {

std::size_t ScanQueue::push(WaitingScan scan, std::size_t most) {
  std::size_t dropped = 0;
  {
    const std::lock_guard lock(mutex_);
    ++counts_.received;
    scans_.push_back(std::move(scan));
    for (; scans_.size() > most; ++dropped) scans_.pop_front();
    counts_.dropped += dropped;
  }
  changed_.notify_one();
  return dropped;
}

std::optional<WaitingScan> ScanQueue::pop() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || !scans_.empty(); });
  if (closed_) return {};
  WaitingScan scan = std::move(scans_.front());
  scans_.pop_front();
  return scan;
}

void ScanQueue::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

ScanQueue::Counts ScanQueue::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts = counts_;
  counts.waiting = scans_.size();
  return counts;
}

}  // namespace octosurf::ros1
