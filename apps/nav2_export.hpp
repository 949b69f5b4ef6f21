#pragma once

#include <optional>
#include <string>

#include <octosurf/map.hpp>
#include <octosurf/storeys.hpp>
#include <octosurf/up.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Options of `export` for a robot's ground: whose, and of a folder for Nav2.
struct RobotGround {
  std::string robot = "biped";                   ///< as plan_query.hpp's robot_in()
  std::optional<double> bridge;                  ///< m
  std::string unknown = "blocked";               ///< or free, see ContactLimits::unknown_to_m
  bool as_mapped = false;                        ///< outlines alone, see GroundRules
  std::optional<double> cell, radius, headroom;  ///< m; empty: StoreyLimits' or the robot's
  double max_step = StoreyLimits().max_step_m, min_area = StoreyLimits().min_area_m2;  ///< m, m²
  std::string stair_operation;
  std::string frame = "map";

  /// Throws Error(usage).
  GroundRules rules(const Eigen::Vector3d& up, double resolution) const;
};

void add_nav2_options(CLI::App& verb, RobotGround& options);

/// Writes the folder, and says what it wrote. Throws as export_nav2().
void export_for_nav2(const Map& map, const Up& up, const RobotGround& options, const std::string& folder,
                     bool force);

}  // namespace octosurf
