#pragma once

#include <cstddef>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf {

/// Which scans of a source are taken: leaves out `skip`, then takes every `every`-th, at most `first`.
struct ScanRange {
  std::size_t skip = 0, every = 1, first = std::numeric_limits<std::size_t>::max();
};

/// Scans of a source; the next one is read and decoded beside the work on the one before.
class ScanFeed {
 public:
  ScanFeed(std::unique_ptr<ScanSource> source, const ScanRange& range);
  ~ScanFeed();
  ScanFeed(const ScanFeed&) = delete;
  ScanFeed& operator=(const ScanFeed&) = delete;

  /// How many there will be, if none is bad.
  std::size_t size() const { return size_; }

  /// The next scan, or nothing at the end. Throws what ScanSource::next() throws, and Error(data) for
  /// a scan that does not fit into memory. No further call after that.
  std::optional<Scan> next();

  /// Left out so far, a line each. Waits for the scan that is being read.
  std::vector<std::string> skipped();

 private:
  void read_ahead();
  std::optional<Scan> read(std::size_t left_out);

  std::unique_ptr<ScanSource> source_;
  ScanRange range_;
  std::size_t size_ = 0;  // asked of source_ before it is read from
  std::size_t asked_ = 0;
  std::future<std::optional<Scan>> ahead_;  // the only one who touches source_ while it is valid
};

}  // namespace octosurf
