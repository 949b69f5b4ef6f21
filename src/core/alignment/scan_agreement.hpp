#pragma once

#include "alignment/pose_search.hpp"
#include "surfaces/map_state.hpp"

#include <octosurf/agreement.hpp>

namespace octosurf::alignment {

/// Compares 400 samples of a scan taken from this pose with the octree. Some 0.2 ms.
Agreement agreement_of(const surfaces::MapState& map, const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                       const RangeLimits& limits);

}  // namespace octosurf::alignment
