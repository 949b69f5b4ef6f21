#pragma once

#include "detection/detector.hpp"
#include "surfaces/cells.hpp"

#include <map>
#include <vector>

namespace octosurf::diagnosis {

/// The reasons why points are pending: repeats detection among all points connected with a place, as the next
/// scan with enough points would, and records the result for every point. The map does not change.
class PendingReasons {
 public:
  /// `state` must not change meanwhile.
  PendingReasons(const surfaces::MapState& state, geometry::VoxelKey place, const detection::Detector* paper);

  /// For a pending point near the place; Reason::waiting if it would now get a surface.
  surfaces::Refusal of(geometry::VoxelKey key) const;
  /// Numbers of pending points within `radius` (m) of `at` by reason.
  std::map<Reason, std::size_t> within(double radius, const Eigen::Vector3d& at) const;

 private:
  void collect_pending(geometry::VoxelKey place);
  bool stands_alone(geometry::VoxelKey key) const;

  surfaces::LoadedView view_;
  std::vector<PointId> pending_;
  std::map<PointId, surfaces::Refusal> reasons_;
};

}  // namespace octosurf::diagnosis
