#pragma once

#include "surfaces/ledger.hpp"
#include "surfaces/map_state.hpp"
#include "surfaces/refusal.hpp"

#include <map>
#include <vector>

namespace octosurf::diagnosis {

/// Why points are pending: surfaces are looked for once more among all that hang together with one of them,
/// as the next scan would that brings enough, and what became of every point is kept. The map stays as it is.
class PendingReasons {
 public:
  /// `state` must stay as it is meanwhile.
  PendingReasons(const surfaces::MapState& state, geometry::VoxelKey place);

  /// Of a pending point near the place; Reason::waiting if a surface would have it now.
  surfaces::Refusal of(geometry::VoxelKey key) const;
  /// How many pending points within `radius` (m) of `at` have each reason.
  std::map<Reason, std::size_t> within(double radius, const Eigen::Vector3d& at) const;

 private:
  void collect_pending(geometry::VoxelKey place);
  bool stands_alone(geometry::VoxelKey key) const;

  const surfaces::MapState& state_;
  occupancy::PointWindow window_;
  std::vector<geometry::VoxelKey> pending_;
  std::map<geometry::VoxelKey, surfaces::Refusal> reasons_;
};

}  // namespace octosurf::diagnosis
