#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include <octosurf/stairs.hpp>
#include <octosurf/storeys.hpp>

// Shared by finding storeys and finding routes.

namespace octosurf::planning {

/// Throws Error(usage) for limits out of range.
void require(const StoreyLimits& limits);

/// Of a stair's edge: its middle in the grids' frame.
Eigen::Vector3d middle_of(const Step& step, const StoreyLimits& limits);

/// Where a robot stands before or after climbing a stair: on its landing, a radius from the edge. Empty
/// without a seen landing.
std::optional<Eigen::Vector3d> landing_of(const Stair& stair, bool above, const StoreyLimits& limits);

/// Cells from each to the nearest that is occupied; 0 where a cell is not free.
std::vector<float> room_in(const Storey& storey);

}  // namespace octosurf::planning
