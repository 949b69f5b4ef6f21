#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_search.hpp"

#include <Eigen/Geometry>

namespace octosurf::alignment {

/// Shares of a scan's readings that cannot be where they would be at a pose. What the map has not seen does
/// not count.
struct Contradiction {
  double in_free_space = 0;  ///< of the octree
  double behind = 0;         ///< surfaces that they would have met
  double all() const { return in_free_space + behind; }
  /// Whether at this pose significantly less contradicts than at another one.
  bool is_less_than(const Contradiction& other) const;
};
/// Of the scan of `search`. Some 3 ms.
Contradiction contradiction_at(const Eigen::Isometry3d& T_map_sensor, const PoseSearch& search,
                               const OccupancyView& octree);

/// A map in which a pose is checked.
struct CheckedMap {
  const Snapshot& snapshot;
  const OccupancyView& octree;
  NearSurfaces& surfaces;  ///< not those of the search that found the pose
  const surfaces::MapState* growing = nullptr;
};

/// Whether a scan was not taken from the pose that explains it best within reach: the map contradicts more of
/// it than changes of a place do, or more than at a right pose while at another one, within 10 m and turned
/// by any angle, it contradicts significantly less and explains as much. `share`: of what contradicts there.
/// Some 0.3 s if that is more than a right pose's.
bool is_refuted(const PoseFit& found, const PoseSearch& search, const CheckedMap& map, double& share);

}  // namespace octosurf::alignment
