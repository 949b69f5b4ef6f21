#pragma once

#include <Eigen/Geometry>
#include <memory>

#include <octosurf/alignment.hpp>
#include <octosurf/map.hpp>

namespace octosurf {

/// Where another map lies in the frame of a map.
struct MapAlignment {
  /// The other map's frame to this one's; what was given unless `scan.outcome` is corrected.
  Eigen::Isometry3d T_map_other = Eigen::Isometry3d::Identity();
  /// Of the other map's points as one scan, taken at `scan.T_map_sensor`: a place near which its sensors were
  /// and which most of its surfaces face. Outcome corrected, unexplained or nothing_known.
  Alignment scan;
};

/// Finds where `other` lies in the frame of `map` by the surfaces of both where they overlap, from a guess
/// that is at most `reach` off, as Mapper::merge() needs it: the points on the other's surfaces are looked
/// for as Localizer looks for a scan. Along directions that the overlap does not fix, the pose stays as
/// given. Deterministic. Some 0.1 s. Throws Error(data) if the pose is not rigid, Error(usage) for a reach
/// that Localizer refuses, Error(incomplete) if `other` is. Nothing may insert into `other` meanwhile.
MapAlignment align_maps(const std::shared_ptr<const Snapshot>& map, const Map& other,
                        const Eigen::Isometry3d& T_map_other = Eigen::Isometry3d::Identity(),
                        const AlignmentReach& reach = {});

}  // namespace octosurf
