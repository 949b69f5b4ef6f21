#include "scan_feed.hpp"

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {

ScanFeed::ScanFeed(std::unique_ptr<ScanSource> source, const ScanRange& range, std::size_t ahead,
                   std::function<bool(const Scan&)> accept)
    : source_(std::move(source)),
      range_(range),
      accept_(std::move(accept)),
      ready_(std::max<std::size_t>(1, ahead)) {
  const std::size_t left = source_->size() - std::min(range_.skip, source_->size());
  size_ = range_.first = std::min(range_.first, (left + range_.every - 1) / range_.every);
  try {
    thread_ = std::thread([this] { read_ahead(); });
  } catch (const std::system_error&) {
    // No thread available: wait_for_one() reads.
  }
}

ScanFeed::~ScanFeed() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ScanFeed::read_ahead() {
  std::unique_lock lock(mutex_);
  while (!ended_) {
    changed_.wait(lock, [this] { return stop_ || !ready_.full(); });
    if (stop_) return;
    busy_ = true;
    lock.unlock();
    Reading reading = read();
    lock.lock();
    busy_ = false;
    ended_ = !reading.scan;
    ready_.push_back(std::move(reading));
    changed_.notify_all();
  }
}

ScanFeed::Reading ScanFeed::read() {
  Reading reading;
  try {
    reading.scan = read_one();
  } catch (...) {
    reading.failure = std::current_exception();
  }
  return reading;
}

std::optional<Scan> ScanFeed::read_one() try {
  while (asked_ < range_.first) {
    if (!source_->skip(asked_++ == 0 ? range_.skip : range_.every - 1)) return {};
    std::optional<Scan> scan = source_->next();
    if (!scan || !accept_ || accept_(*scan)) return scan;
    ++refused_;
  }
  return {};
} catch (const std::bad_alloc&) {
  throw Error(Error::Kind::data, "scan " + std::to_string(asked_), "does not fit into memory");
}

void ScanFeed::wait_for_one(std::unique_lock<std::mutex>& lock) {
  if (thread_.joinable()) {
    changed_.wait(lock, [this] { return !ready_.empty() || ended_; });
  } else if (ready_.empty() && !ended_) {
    ready_.push_back(read());
    ended_ = !ready_.front().scan;
  }
}

std::optional<Scan> ScanFeed::next() {
  std::unique_lock lock(mutex_);
  wait_for_one(lock);
  if (ready_.empty()) return {};
  Reading reading = std::move(ready_.front());
  ready_.pop_front();
  changed_.notify_all();
  if (reading.failure) std::rethrow_exception(reading.failure);
  return std::move(reading.scan);
}

const Scan* ScanFeed::peek() {
  std::unique_lock lock(mutex_);
  wait_for_one(lock);
  return !ready_.empty() && ready_.front().scan ? &*ready_.front().scan : nullptr;
}

std::vector<std::string> ScanFeed::skipped() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !busy_; });
  return source_->skipped();
}

std::vector<std::string> ScanFeed::notes() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !busy_; });
  return source_->notes();
}

}  // namespace octosurf
