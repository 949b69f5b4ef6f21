#include "mapper/scan_ahead.hpp"

#include <cstring>

namespace octosurf::mapper {
namespace {

/// Compares everything that voxels and rays depend on; points bit by bit, because missing readings may be
/// NaN.
bool traced_alike(const Scan& a, const Scan& b) {
  return a.sensor == b.sensor && a.T_map_sensor.matrix() == b.T_map_sensor.matrix() &&
         a.points.size() == b.points.size() &&
         (a.points.empty() ||
          std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof a.points[0]) == 0);
}

}  // namespace

std::optional<TracedScan> ScanAhead::take(const Scan& scan) {
  std::optional<TracedScan> traced = std::exchange(traced_, {});
  if (traced && !traced_alike(scan, scan_)) traced.reset();
  return traced;
}

}  // namespace octosurf::mapper
