#pragma once

#include "evaluation/truth.hpp"

#include <cstddef>
#include <string>
#include <vector>

#include <octosurf/stairs.hpp>

namespace octosurf::evaluation {

/// How one true stair was found.
struct StairScore {
  std::string kind;         ///< TrueStair::kind
  std::size_t steps = 0;    ///< that it has
  double seen = 0;          ///< least share of a tread that was seen
  std::size_t pieces = 0;   ///< stairs found on it; what follows is of the one with the most steps
  std::size_t found = 0;    ///< its steps; 0: none found
  double riser_m = 0;       ///< error of the mean riser
  double tread_m = 0;       ///< error of the mean tread
  double width_m = 0;       ///< error of the width
  double heading_rad = 0;   ///< error of the heading
  bool right_kind = false;  ///< straight, turning or spiral as built
};

struct StairScores {
  std::vector<StairScore> stairs;  ///< one for each of the truth
  std::size_t invented = 0;        ///< found where the truth has none
};

/// Compares found stairs with those of a truth. A found step lies on a true one if the middle of its edge is
/// within 5 cm in height, and otherwise within 10 cm of the true edge; a stair on that which has most of its
/// steps.
StairScores evaluate_stairs(const std::vector<Stair>& found, const Truth& truth, const Eigen::Vector3d& up);

}  // namespace octosurf::evaluation
