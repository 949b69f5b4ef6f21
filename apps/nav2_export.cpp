// A folder for Nav2: a grid per storey, and a route over stairs.
#include "nav2_export.hpp"

#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "plan_query.hpp"
#include "planning/questions.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <vector>

#include <octosurf/ground.hpp>
#include <octosurf/planner_formats.hpp>

namespace octosurf {
namespace {

// Floors are level to this (up.hpp): an estimate that near to z leaves the map as the robot's poses have it.
constexpr double level_rad = 5 * rad_per_deg;

Eigen::Quaterniond turn_of(const Up& up) {
  const double from_z = std::atan2(up.direction.head<2>().norm(), up.direction.z());
  if (up.source != Up::Source::given && from_z <= level_rad) return Eigen::Quaterniond::Identity();
  return upright(up.direction);
}

}  // namespace

GroundRules RobotGround::rules(const Eigen::Vector3d& up, double resolution) const {
  planning::ContactQuestion query;
  query.robot = robot_in(robot);
  query.unknown_is_free = unknown == "free";
  query.as_mapped = as_mapped;
  GroundRules rules = planning::rules_of(query, up, resolution);
  rules.widest_unseen_m = bridge;
  return rules;
}

void add_nav2_options(CLI::App& verb, RobotGround& options) {
  verb.option_defaults()->group("Of a folder for Nav2");
  verb.add_option("--cell", options.cell, "m: of grids [0.05]")->check(more_than(0));
  verb.add_option("--frame", options.frame, "frame id of the route")->capture_default_str();
  verb.add_option("--radius", options.radius, "m: of the robot's footprint [of --robot]")
      ->check(more_than(0));
  verb.add_option("--headroom", options.headroom, "m: what is higher is no obstacle [of --robot]")
      ->check(more_than(0));
  verb.add_option("--max-step", options.max_step, "m: the highest step within a storey")
      ->check(more_than(0))
      ->capture_default_str();
  verb.add_option("--min-area", options.min_area, "m2: of a storey to which no stair leads")
      ->check(at_least(0))
      ->capture_default_str();
  verb.add_option("--stair-operation", options.stair_operation,
                  "the route server's operation where a stair is entered and left [none]");
  verb.option_defaults()->group("Options");
}

void export_for_nav2(const Map& map, const Up& up, const RobotGround& options, const std::string& folder,
                     bool force) {
  const GroundView ground(map.snapshot(), map.octree(),
                          options.rules(up.direction, map.octree().resolution()));
  StoreyLimits limits = StoreyLimits::of(robot_in(options.robot));
  limits.radius_m = options.radius.value_or(limits.radius_m);
  limits.headroom_m = options.headroom.value_or(limits.headroom_m);
  limits.cell_m = options.cell.value_or(limits.cell_m);
  limits.max_step_m = options.max_step;
  limits.min_area_m2 = options.min_area;
  limits.turn = turn_of(up);
  const std::vector<Storey> storeys = find_storeys(ground, limits);
  const StoreyRoute route = find_route(ground, storeys, limits);
  const std::vector<Stair>& stairs = ground.stairs().stairs;
  export_nav2(storeys, route, stairs, options.frame, folder, force, options.stair_operation);
  for (std::size_t i = 0; i < storeys.size(); ++i)
    std::printf("storey_%zu: %zu x %zu cells of %g m at z = %.2f m, %.1f m2 free\n", i, storeys[i].columns,
                storeys[i].rows, storeys[i].cell_m, storeys[i].height_m, storeys[i].area_m2);
  if (route.edges.empty())
    std::printf("no route.geojson: no stair or seam connects two places\n");
  else
    std::printf("route.geojson: %zu nodes, %zu edges, %zu stairs\n", route.nodes.size(), route.edges.size(),
                stairs.size() - route.without_landing.size());
  for (const std::size_t i : route.without_landing)
    std::fprintf(stderr, "left out: stair %u, an end of which is in no storey\n", stairs[i].id);
  if (limits.turn.angularDistance(Eigen::Quaterniond::Identity()) > 0)
    std::printf("turned so that up is +z, by the quaternion x %.9g y %.9g z %.9g w %.9g\n", limits.turn.x(),
                limits.turn.y(), limits.turn.z(), limits.turn.w());
}

}  // namespace octosurf
