#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf {

/// Options of `plan`.
struct PlanQuery {
  std::string robot = "biped", foot;                   ///< as --robot and --foot take them
  std::vector<double> from, to;                        ///< x y z, m, and the heading, degrees
  std::vector<std::pair<std::string, double>> limits;  ///< option and value, as given
  PlanBudget budget;
};

/// An option's limit, and its field in each robot; null: that robot has none.
struct LimitOption {
  const char* name;
  const char* help;
  double unit;  ///< of the option in SI
  double* (*biped)(Biped&);
  double* (*quadruped)(Quadruped&);
};

const std::vector<LimitOption>& limit_options();

/// Throws Error(usage) for an invalid foot and a limit that the robot does not have.
Robot robot_of(const PlanQuery& query, const Eigen::Vector3d& up);

Standing standing_of(const std::vector<double>& xyz_and_deg);

/// The surfaces as the robot's feet meet them: without voids, and without unseen gaps that are too wide for a
/// foot (gaps.hpp).
std::shared_ptr<const Snapshot> ground_for(const Snapshot& snapshot, const OccupancyView& octree,
                                           const Robot& robot);

/// Whether its limits need label_edges().
bool needs_edge_kinds(const Robot& robot);

}  // namespace octosurf
