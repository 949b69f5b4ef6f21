#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/samples.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Candidate poses that match planes of a scan with surfaces, each from three planes in general position:
/// every combination of the scan's larger planes with candidate surfaces within reach, those with most
/// readings first, at most `most`. Along undetermined directions, the pose stays at `start`.
std::vector<Eigen::Isometry3d> poses_by_planes(const Scan& scan, const sensing::NoiseModel& noise,
                                               const RangeLimits& limits, double resolution,
                                               std::span<const AlignedSurface* const> surfaces,
                                               const Eigen::Isometry3d& start, const AlignmentReach& reach,
                                               std::size_t most);

}  // namespace octosurf::alignment
