// Composes the contents of planners' formats: contact regions, a grid of heights.
#include "planner_export.hpp"

#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "plan_query.hpp"
#include "planning/questions.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/planning.hpp>
#include <octosurf/storeys.hpp>

namespace octosurf {
namespace {

// Floors are level to this (up.hpp): an estimate that near to z leaves the map as the robot's poses have it.
constexpr double level_rad = 5 * rad_per_deg;

ContactShape chosen_foot(const PlannerExport& options) {
  if (options.foot.empty())
    return options.foot_radius ? ContactShape::disc(*options.foot_radius) : PlannerContact().shape;
  if (options.foot_radius)
    throw Error(Error::Kind::usage, "--foot", "and --foot-radius are two feet", "give one of them");
  return planning::foot_of(options.foot);
}

GroundRules chosen_rules(const PlannerExport& options, const Eigen::Vector3d& up, double resolution) {
  planning::ContactQuestion query;
  const bool nav2 = options.format == "nav2";
  query.robot = nav2 ? robot_in(options.robot) : Quadruped{};
  query.max_slope_rad = options.max_slope_deg * rad_per_deg;
  query.clearance_m = options.clearance;
  query.as_mapped = options.as_mapped;
  query.unknown_is_free = options.unknown == "free";
  GroundRules rules = planning::rules_of(query, up, resolution);
  if (!nav2) rules.foot = chosen_foot(options);
  rules.widest_unseen_m = nav2 ? options.bridge : std::nullopt;
  return rules;
}

Eigen::Quaterniond turn_of(const Up& up) {
  const double from_z = std::atan2(up.direction.head<2>().norm(), up.direction.z());
  if (up.source != Up::Source::given && from_z <= level_rad) return Eigen::Quaterniond::Identity();
  return upright(up.direction);
}

/// One export: the map, the options, and the output frame.
class PlannerExporter {
 public:
  PlannerExporter(const Map& map, const Up& up, const PlannerExport& options, std::string file, bool force)
      : ground_(map.snapshot(), map.octree(), chosen_rules(options, up.direction, map.octree().resolution())),
        options_(options),
        turn_(turn_of(up)),
        file_(std::move(file)),
        force_(force) {}

  void run() const {
    const std::string& format = options_.format;
    if (format == "planar_terrain") write_terrain();
    if (format == "grid_map") write_grid();
    if (format == "nav2") write_nav2();
    if (turn_.angularDistance(Eigen::Quaterniond::Identity()) > 0)
      std::printf("turned so that up is +z, by the quaternion x %.9g y %.9g z %.9g w %.9g\n", turn_.x(),
                  turn_.y(), turn_.z(), turn_.w());
  }

 private:
  std::vector<PlannerSurface> contact_surfaces() const {
    PlannerContact contact;
    contact.shape = ground_.rules().foot;
    contact.limits = ground_.rules().limits;
    if (options_.yaw_deg) contact.yaw_rad = *options_.yaw_deg * rad_per_deg;
    contact.turn = turn_;
    return planner_surfaces(*ground_.solid(), contact, &ground_.octree());
  }

  HeightGrid grid(double steepest) const {
    HeightGridOptions wanted;
    wanted.cell = options_.cell.value_or(0);
    wanted.turn = turn_;
    wanted.max_slope_rad = std::min(options_.max_slope_deg * rad_per_deg, steepest);
    wanted.below = options_.below;
    return height_grid(*ground_.solid(), wanted);
  }

  void write_terrain() const {
    const PlanarTerrainCount count =
        export_planar_terrain(contact_surfaces(), grid(80 * rad_per_deg), options_.frame, file_, force_);
    std::printf("%s: %zu regions\n", file_.c_str(), count.regions);
    if (count.without_inset + count.too_steep > 0)
      std::fprintf(stderr, "left out: %zu regions without room for the foot, %zu steeper than 80 degrees\n",
                   count.without_inset, count.too_steep);
  }

  void write_grid() const {
    const HeightGrid heights = grid(std::numbers::pi);
    export_grid_map(heights, options_.frame, file_, force_);
    std::printf("%s: %td x %td cells of %g m\n", file_.c_str(), heights.elevation.rows(),
                heights.elevation.cols(), heights.cell);
  }

  void write_nav2() const {
    StoreyLimits limits = StoreyLimits::of(robot_in(options_.robot));
    limits.radius_m = options_.radius.value_or(limits.radius_m);
    limits.headroom_m = options_.headroom.value_or(limits.headroom_m);
    limits.cell_m = options_.cell.value_or(limits.cell_m);
    limits.max_step_m = options_.max_step;
    limits.min_area_m2 = options_.min_area;
    limits.turn = turn_;
    const std::vector<Storey> storeys = find_storeys(ground_, limits);
    const StoreyRoute route = find_route(ground_, storeys, limits);
    const std::vector<Stair>& stairs = ground_.stairs().stairs;
    export_nav2(storeys, route, stairs, options_.frame, file_, force_, options_.stair_operation);
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
  }

  GroundView ground_;
  const PlannerExport& options_;
  Eigen::Quaterniond turn_;
  std::string file_;
  bool force_;
};

}  // namespace

void add_planner_options(CLI::App& verb, PlannerExport& options) {
  verb.add_option("--format", options.format,
                  "planar_terrain or grid_map (.json, .cdr), nav2 (a folder); docs/formats.md, section 7 "
                  "[--to's ending decides: nav2 for one with a slash]")
      ->check(CLI::IsMember({"planar_terrain", "grid_map", "nav2"}));
  verb.option_defaults()->group("For planners' own formats (--format)");
  verb.add_option("--foot", options.foot,
                  "LENGTHxWIDTH of a sole about its reference point, or a radius; m [--foot-radius]");
  verb.add_option("--foot-radius", options.foot_radius, "m: a round foot [0.06]")->check(at_least(0));
  verb.add_option("--yaw", options.yaw_deg, "heading of --foot, degrees [any heading]");
  verb.add_option("--max-slope", options.max_slope_deg, "degrees against up")
      ->check(between(0, 180))
      ->capture_default_str();
  verb.add_option("--clearance", options.clearance,
                  "m: height over the foot that must be clear; 0: not checked [0.6]")
      ->check(at_least(0));
  verb.add_option("--cell", options.cell, "m: of height grids [the map's resolution], of nav2's [0.05]")
      ->check(more_than(0));
  verb.add_option("--below", options.below, "m: height grids ignore what is above [all counts]");
  verb.add_option("--frame", options.frame, "frame id of planar_terrain, grid_map and nav2's route")
      ->capture_default_str();
  verb.add_option("--radius", options.radius, "m: nav2: of the robot's footprint [of --robot]")
      ->check(more_than(0));
  verb.add_option("--headroom", options.headroom, "m: nav2: what is higher is no obstacle [of --robot]")
      ->check(more_than(0));
  verb.add_option("--max-step", options.max_step, "m: nav2: the highest step within a storey")
      ->check(more_than(0))
      ->capture_default_str();
  verb.add_option("--min-area", options.min_area, "m2: nav2: of a storey to which no stair leads")
      ->check(at_least(0))
      ->capture_default_str();
  verb.add_option("--stair-operation", options.stair_operation,
                  "nav2: the route server's operation where a stair is entered and left [none]");
  verb.option_defaults()->group("Options");
}

void export_for_planner(const Map& map, const Up& up, const PlannerExport& options, const std::string& file,
                        bool force) {
  PlannerExporter(map, up, options, file, force).run();
}

}  // namespace octosurf
