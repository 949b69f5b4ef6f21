#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/scan_planes.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Poses that take planes of a scan onto surfaces, each from three planes that fix it as far as three can:
/// every combination of the scan's larger planes with surfaces that they may be within reach, the ones with
/// most readings first, at most `most`. Where the planes fix nothing, the pose stays at `start`.
std::vector<Eigen::Isometry3d> poses_by_planes(std::span<const ScanPlane> planes,
                                               std::span<const AlignedSurface* const> surfaces,
                                               const Eigen::Isometry3d& start, const AlignmentReach& reach,
                                               std::size_t most);

}  // namespace octosurf::alignment
