#pragma once

#include "footsteps/foothold_field.hpp"

#include <array>
#include <functional>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// The place nearest to the goal reached by a failed search (walking frame), and the obstacles there.
struct Frontier {
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  double nearest_m = 0;
  std::array<std::size_t, step_refusal_names.size()> refused{};
};

/// Result of a search without a plan.
enum class Ending {
  start_exhausted,  ///< all reachable nodes were expanded
  goal_cut_off,     ///< all nodes that can reach the goal were expanded
  budget
};
NoPlan refusal_of(const FootholdField& field, const Frontier& frontier, Ending ending,
                  std::size_t expansions);
/// "start: the left foot …", for the feet without foothold; also the nearest place to `at` where `stands` is
/// true (walking frame).
NoPlan refusal_of(FootholdField& field, NoPlan::Why why, const std::vector<Gait::Foot>& feet,
                  const Standing& at, const std::function<bool(const Standing&)>& stands);

}  // namespace octosurf::footsteps
