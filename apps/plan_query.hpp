#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::planning {
class AskedMap;
}

namespace octosurf {

/// A limit of a robot, and where each has it. `Field` takes the robots that do, and keeps nothing.
struct RobotLimit {
  template <class Field>
  RobotLimit(const char* called, const char* text, double given_in, Field)
      : name(called), help(text), unit(given_in), of([](Robot& robot) {
          return std::visit(
              [](auto& kind) -> double* {
                if constexpr (std::is_invocable_v<Field, decltype(kind)>) return Field()(kind);
                return nullptr;
              },
              robot);
        }) {}

  const char *name, *help;  ///< name without unit
  double unit;              ///< in which it is given, in SI
  double* (*of)(Robot&);    ///< null: the robot has none

  std::string field() const;  ///< name with unit: "max_up_m"
};

const std::vector<RobotLimit>& robot_limits();

struct PlanQuery {
  Robot robot = Biped{};
  std::optional<ContactShape> foot;
  Standing from, to;
  std::vector<std::pair<const RobotLimit*, double>> limits;  ///< SI
  bool unknown_is_free = false;                              ///< where feet and legs would be
  PlanBudget budget;
};

/// "biped", "quadruped", or a file: a JSON object with one of these as "robot", its "foot" as in --foot, and
/// those of its limits that differ, by name and unit ("max_up_m", "max_turn_deg"). Throws Error(usage, io or
/// data).
Robot robot_in(const std::string& name_or_file);
std::string name_of(const Robot& robot);

/// Throws Error(usage) for a limit that the robot does not have.
Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up);

/// A planner on the surfaces as the robot's feet meet them: without voids, and without unseen gaps that are
/// too wide for a foot (gaps.hpp).
FootstepPlanner planner_on(const planning::AskedMap& map, const Robot& robot);

}  // namespace octosurf
