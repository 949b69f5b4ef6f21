#pragma once

#include "footsteps/swing.hpp"

#include <Eigen/Core>
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
  double sidling_m = 0;      ///< likewise sideways or backward, usually
  double body_step_m = 0;    ///< the farthest that one step moves the body's middle
  double off_guide_m = 0;    ///< by which the guide's path may be longer than the body's
  int steps = 1;             ///< in a usual move
  int least_steps = 1;       ///< in any move

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
