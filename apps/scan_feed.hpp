#pragma once

#include <atomic>
#include <boost/circular_buffer.hpp>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf {

/// Selects scans of a source: skips `skip`, then takes every `every`-th, at most `first`.
struct ScanRange {
  std::size_t skip = 0, every = 1, first = std::numeric_limits<std::size_t>::max();
};

/// Reads and decodes the next scans of a source in parallel with the mapping.
class ScanFeed {
 public:
  /// `ahead`: number of scans to prefetch, at least 1. `accept` returns whether to map a scan;
  /// called from the reading thread.
  ScanFeed(std::unique_ptr<ScanSource> source, const ScanRange& range, std::size_t ahead = 1,
           std::function<bool(const Scan&)> accept = {});
  ~ScanFeed();
  ScanFeed(const ScanFeed&) = delete;
  ScanFeed& operator=(const ScanFeed&) = delete;

  /// Number of scans, if none is bad and all are accepted.
  std::size_t size() const { return size_; }

  /// The next scan, or empty at the end. Throws what ScanSource::next() throws, and Error(data) for a scan
  /// that does not fit into memory. Do not call it again after that.
  std::optional<Scan> next();

  /// The scan that next() will return, null if there is none or next() will throw. Valid until then.
  const Scan* peek();

  /// Skipped so far, a line each. Waits for the scan being read.
  std::vector<std::string> skipped();
  /// ScanSource::notes() so far. Waits likewise.
  std::vector<std::string> notes();
  /// Number of scans not accepted so far.
  std::size_t refused() const { return refused_; }

 private:
  struct Reading {
    std::optional<Scan> scan;
    std::exception_ptr failure;
  };
  void read_ahead();
  Reading read();
  std::optional<Scan> read_one();
  void wait_for_one(std::unique_lock<std::mutex>& lock);

  std::unique_ptr<ScanSource> source_;  // accessed only by the thread that set busy_
  ScanRange range_;
  std::function<bool(const Scan&)> accept_;
  std::atomic<std::size_t> refused_{0};
  std::size_t size_ = 0;   // read from source_ before the first scan
  std::size_t asked_ = 0;  // scans

  std::mutex mutex_;  // guards the following members
  std::condition_variable changed_;
  boost::circular_buffer<Reading> ready_;  // allocated once: the thread that fills it must not fail
  bool busy_ = false, ended_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace octosurf
