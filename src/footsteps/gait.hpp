#pragma once

#include "footsteps/swing.hpp"
#include "footsteps/walk_table.hpp"

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

/// Heights of a swinging foot over the ground, of which one must be free, and of the hip.
struct Lift {
  double usual = 0, high = 0, hip = 0;
};

/// A robot in the numbers that a search needs. A move is an edge of its graph: one step of a biped, a cycle
/// of a quadruped's steps.
struct Gait {
  struct Foot {
    FootName name;
    Eigen::Vector2d at;  ///< in stance, from the body's middle: forward, left
  };
  std::vector<Foot> feet;
  ContactShape sole;
  ContactLimits contact;
  StepCosts costs;
  BodyBox body;
  Lift lift;
  double max_up_m, max_down_m, max_turn_rad;
  bool round_feet = false;   ///< one foothold for all headings
  double disc_radius_m = 0;  ///< inside a sole, about its reference point
  double reach_m = 0;        ///< level, between footholds one step apart, for the guide
  double trunk_reach_m = 0;  ///< from above a foothold, part of the body wherever it is; 0: none
  double longest_m = 0;      ///< move of the body
  double off_hip_m = 0;      ///< the farthest that a foot stands from below its hip
  /// Of the middle between the feet, without `costs.length`: no move gets farther for less; usual ones.
  std::vector<WalkTable::Motion> best{}, usual{};

  /// Of a step or cycle, in headings.
  int turns() const {
    return static_cast<int>(max_turn_rad * WalkTable::headings / (2 * std::numbers::pi) + 1e-9);
  }
  double turn_cost(double rad) const { return rad == 0 ? 0 : costs.turn * std::abs(rad) / max_turn_rad; }

  template <class Kind>
  Gait(const Kind& robot, std::vector<Foot> all_feet)
      : feet(std::move(all_feet)),
        sole(robot.foot),
        contact(robot.contact),
        costs(robot.costs),
        body(robot.body),
        lift{robot.lift_m, robot.high_lift_m, robot.body.from_m},
        max_up_m(robot.max_up_m),
        max_down_m(robot.max_down_m),
        max_turn_rad(robot.max_turn_rad) {}
};
Gait gait_of(const Biped& robot);
Gait gait_of(const Quadruped& robot);

}  // namespace octosurf::footsteps
