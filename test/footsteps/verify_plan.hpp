#pragma once

#include <octosurf/footsteps.hpp>

namespace octosurf::test {

/// Checks every step of a biped's or quadruped's plan without the planner's tables, by foothold(), the step
/// limits and boxes in the octree, whose voxels are read as by the planner. Returns a sentence per violation.
std::vector<std::string> verify_plan(const FootstepPlan& plan, const Snapshot& snapshot,
                                     const OccupancyView& octree, const Robot& robot);

}  // namespace octosurf::test
