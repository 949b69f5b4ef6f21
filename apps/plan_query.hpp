#pragma once

#include <optional>
#include <string>

#include <octosurf/footsteps.hpp>

namespace CLI {
class App;
}  // namespace CLI

namespace octosurf {

struct PlanQuery {
  Robot robot = Biped{};
  std::optional<ContactShape> foot;
  Standing from, to;
  bool unknown_is_free = false;  ///< where feet and legs would be
  PlanBudget budget;
};

/// "biped", "quadruped", or a file: a JSON object with one of these as "robot", its "foot" as in --foot, and
/// those of its limits that differ, by name and unit ("max_up_m", "max_turn_deg"). Throws Error(usage, io or
/// data).
Robot robot_in(const std::string& name_or_file);
std::string name_of(const Robot& robot);

Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up);

/// --robot, --foot and --unknown.
void add_robot_options(CLI::App& verb, Robot& robot, std::optional<ContactShape>& foot,
                       bool& unknown_is_free);

}  // namespace octosurf
