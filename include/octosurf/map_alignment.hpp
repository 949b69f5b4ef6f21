#pragma once

#include <Eigen/Geometry>
#include <memory>

#include <octosurf/alignment.hpp>
#include <octosurf/map.hpp>

namespace octosurf {

/// Pose of another map in the frame of a map.
struct MapAlignment {
  /// The other map's frame to this one's; the given guess unless `scan.outcome` is corrected.
  Eigen::Isometry3d T_map_other = Eigen::Isometry3d::Identity();
  /// Alignment of the other map's points as one scan of a sensor that moved about `scan.T_map_sensor`.
  /// Outcome corrected, unexplained or nothing_known.
  Alignment scan;
};

/// Estimates the pose of `other` in the frame of `map` from the surfaces in their overlap, for
/// Mapper::merge(). The guess may be off by `reach`: the points on the other's surfaces are matched as
/// Localizer matches a scan. Along directions that the overlap does not determine, the pose stays as given.
/// Deterministic. Some 0.1 s. Throws Error(data) if the pose is not rigid, Error(usage) for a reach that
/// Localizer rejects, Error(incomplete) if `other` is incomplete. Do not insert into `other` during the call.
MapAlignment align_maps(const std::shared_ptr<const Snapshot>& map, const Map& other,
                        const Eigen::Isometry3d& T_map_other = Eigen::Isometry3d::Identity(),
                        const AlignmentReach& reach = {});

}  // namespace octosurf
