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

/// Options of `export`: whose ground, and those of `--format`.
struct PlannerExport {
  std::string robot = "biped";        ///< as plan_query.hpp's robot_in()
  std::optional<double> bridge;       ///< m
  std::string unknown = "blocked";    ///< or free, see ContactLimits::unknown_to_m
  bool as_mapped = false;             ///< outlines alone, see GroundRules
  std::string format;                 ///< empty: not a planner's format
  std::string foot;                   ///< "LxW", m; empty: a disc
  std::optional<double> foot_radius;  ///< m
  std::optional<double> yaw_deg;      ///< of a foot that is no disc; empty: any heading
  double max_slope_deg = 30;
  std::optional<double> cell, below, clearance;  ///< m
  std::optional<double> radius, headroom;        ///< m, of nav2; empty: the robot's
  double max_step = StoreyLimits().max_step_m, min_area = StoreyLimits().min_area_m2;  ///< m, m²
  std::string stair_operation;                                                         ///< of nav2
  std::string frame = "map";
};

void add_planner_options(CLI::App& verb, PlannerExport& options);

/// Writes the map to `file` in the format of the options, and says what it wrote. Throws Error(usage) for
/// options that make no sense, and as planner_formats.hpp.
void export_for_planner(const Map& map, const Up& up, const PlannerExport& options, const std::string& file,
                        bool force);

}  // namespace octosurf
