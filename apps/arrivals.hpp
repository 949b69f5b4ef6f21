#pragma once

#include "scan_feed.hpp"

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf {

/// Maximum number of scans inserted together: half a second of a camera's, 60 MB.
inline constexpr std::size_t most_joined = 16;

/// Has scans arrive at their time stamps (`--realtime`): waits for each, and once the mapper has fallen
/// behind, joins those that wait.
class Arrivals {
 public:
  explicit Arrivals(std::function<double()> now_s) : now_s_(std::move(now_s)) {}

  /// On the clock of now_s. From any thread, once the first scan has arrived.
  double of(const Scan& scan) const { return zero_s_ + scan.stamp_s; }
  /// Waits for the first of `scans`, or until interrupted(); then others may be added to it. `last_stamp_s`:
  /// of the scan before it.
  void wait_and_join(std::vector<PreparedScan>& scans, ScanFeed& feed, std::optional<double> last_stamp_s);

 private:
  std::function<double()> now_s_;
  double zero_s_ = 0;  // arrival of the time stamp 0
};

}  // namespace octosurf
