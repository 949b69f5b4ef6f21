#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::planning {
class AskedMap;
}

namespace octosurf {

/// A limit of a robot, and its field in each; null: that robot has none.
struct RobotLimit {
  const char* name;  ///< without unit
  const char* help;
  double unit;  ///< in which it is given, in SI
  double* (*biped)(Biped&);
  double* (*quadruped)(Quadruped&);
};

const std::vector<RobotLimit>& robot_limits();

struct PlanQuery {
  std::string robot = "biped";
  std::optional<ContactShape> foot;
  Standing from, to;
  std::vector<std::pair<const RobotLimit*, double>> limits;  ///< SI
  PlanBudget budget;
};

/// Throws Error(usage) for a limit that the robot does not have.
Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up);

/// A planner on the surfaces as the robot's feet meet them: without voids, and without unseen gaps that are
/// too wide for a foot (gaps.hpp).
FootstepPlanner planner_on(const planning::AskedMap& map, const Robot& robot);

}  // namespace octosurf
