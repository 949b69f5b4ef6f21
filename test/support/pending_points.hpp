#pragma once

#include "support/map_state.hpp"

namespace octosurf::test {

/// Scans in an octree in which nothing has been detected, and all of their points.
class PendingPoints {
 public:
  explicit PendingPoints(const std::vector<Scan>& scans, const Parameters& parameters = {})
      : state(parameters), ledger((put(state, scans), state)) {
    std::vector<geometry::VoxelKey> keys;
    state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) { keys.push_back(p.key); });
    std::sort(keys.begin(), keys.end());
    for (const geometry::VoxelKey key : keys) all.push_back(ledger.window.find(key));
  }

  Eigen::Vector3d position(PointId i) const { return ledger.window[i].position.cast<double>(); }

  surfaces::MapState state;
  surfaces::Ledger ledger;
  std::vector<PointId> all;  ///< in key order, as detection hands regions on

 private:
  static void put(surfaces::MapState& map, const std::vector<Scan>& scans) {
    for (const Scan& scan : scans) occupy(map, scan);
  }
};

}  // namespace octosurf::test
