#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Selects scans of a source: skips `skip`, then takes every `every`-th, at most `first`.
struct ScanRange {
  std::size_t skip = 0, every = 1, first = std::numeric_limits<std::size_t>::max();
  Eigen::Isometry3d T_map_poses = Eigen::Isometry3d::Identity();  ///< by which their poses are moved
};

/// Options for reading and selecting scans.
void add_scan_options(CLI::App& verb, ScanSourceOptions& source, ScanRange& range);

/// Reads and decodes the scans of a range of a source. One thread at a time.
class ScanFeed {
 public:
  /// `accept` returns whether to map a scan.
  ScanFeed(std::unique_ptr<ScanSource> source, const ScanRange& range,
           std::function<bool(const Scan&)> accept = {});

  /// Number of scans, if none is bad and all are accepted.
  std::size_t size() const { return range_.first; }

  /// The next scan, or empty at the end. Throws what ScanSource::next() throws, and Error(data) for a scan
  /// that does not fit into memory. Do not call it again after that.
  std::optional<Scan> next();

  /// The scan that next() will return, null if there is none or next() will throw. Valid until then.
  const Scan* peek();

  const std::vector<std::string>& skipped() const { return source_->skipped(); }  ///< so far, a line each
  std::vector<std::string> notes() const { return source_->notes(); }             ///< so far
  std::size_t refused() const { return refused_; }  ///< number of scans not accepted so far

 private:
  std::optional<Scan> read();

  std::unique_ptr<ScanSource> source_;
  ScanRange range_;  // first: at most as many as there are
  std::function<bool(const Scan&)> accept_;
  std::size_t asked_ = 0, refused_ = 0;  // scans
  std::optional<Scan> peeked_;
  std::exception_ptr failure_;  // of peek()
};

}  // namespace octosurf
