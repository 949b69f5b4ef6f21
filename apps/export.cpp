// `octosurf export`: a map's surfaces in a file other programs read.
#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/export_mcap.hpp"
#include "io/kept_scans.hpp"
#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "plan_query.hpp"
#include "planning/questions.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/octomap_files.hpp>
#include <octosurf/adapters/octree.hpp>
#include <octosurf/error.hpp>
#include <octosurf/export.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/map.hpp>
#include <octosurf/planner_formats.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf {
namespace {

constexpr const char* export_description = R"(Writes a map's surfaces to a file other programs read.

Examples:
  octosurf export maps/office --to office.json
  octosurf export maps/office --to office.json --what convex   convex pieces for planners, too
  octosurf export maps/office --to office.glb --what meshes    closed solids, for any 3-D viewer
  octosurf export maps/office --to points.ply --what points    inliers, labelled by surface
  octosurf export maps/office --to office.ot                   the octree with its log-odds, for OctoMap's tools
  octosurf export maps/office --to office.mcap                 surfaces and poses, for Foxglove
  octosurf export maps/office --to nav2/                       a grid per storey and a route over stairs, for Nav2
)";

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
  GroundRules rules(const Eigen::Vector3d& up, double resolution) const {
    planning::ContactQuestion query;
    query.robot = robot_in(robot);
    query.unknown_is_free = unknown == "free";
    query.as_mapped = as_mapped;
    GroundRules rules = planning::rules_of(query, up, resolution);
    rules.widest_unseen_m = bridge;
    return rules;
  }
};

struct ExportArguments {
  std::string map, file, up;
  std::vector<std::string> what{"polygons"};
  double thickness = ExportOptions().mesh_thickness;
  bool force = false;
  RobotGround ground;
};

// Floors are level to this (up.hpp): an estimate that near to z leaves the map as the robot's poses have it.
constexpr double level_rad = 5 * rad_per_deg;

Eigen::Quaterniond turn_of(const Up& up) {
  const double from_z = std::atan2(up.direction.head<2>().norm(), up.direction.z());
  if (up.source != Up::Source::given && from_z <= level_rad) return Eigen::Quaterniond::Identity();
  return upright(up.direction);
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

/// Writes the folder, and says what it wrote.
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
    std::fprintf(stderr, "left out: stair %ju, an end of which is in no storey\n", stairs[i].id);
  if (limits.turn.angularDistance(Eigen::Quaterniond::Identity()) > 0)
    std::printf("turned so that up is +z, by the quaternion x %.9g y %.9g z %.9g w %.9g\n", limits.turn.x(),
                limits.turn.y(), limits.turn.z(), limits.turn.w());
}

/// What the wanted parts take that the snapshot lacks.
void add_parts(const Map& map, const Snapshot& snapshot, ExportOptions& options) {
  const auto wants = [&](ExportPart part) {
    return std::ranges::find(options.parts, part) != options.parts.end();
  };
  if (wants(ExportPart::convex))
    for (const SurfacePtr& surface : snapshot.surfaces)
      options.convex[surface->id] = convex_pieces(*surface, surface->polygons);
  if (wants(ExportPart::points))
    map.for_each_point([&](const OccupancyView::Voxel& voxel) {
      if (voxel.surface != 0) options.points[voxel.surface].push_back(voxel.point);
    });
}

void export_by_ending(const Map& map, const Up& up, const ExportArguments& arguments) {
  ExportOptions options;
  options.force = arguments.force;
  options.parts.clear();
  for (const std::string& name : arguments.what) {
    const auto at = std::ranges::find(export_part_names, name);
    options.parts.push_back(static_cast<ExportPart>(at - export_part_names.begin()));
  }
  options.up = up.direction;
  options.origin = map.origin();
  options.mesh_thickness = arguments.thickness;
  std::shared_ptr<const Snapshot> snapshot = map.snapshot();
  Stairs stairs = find_stairs(*snapshot, up.direction);
  std::size_t without_ground = 0;
  const RobotGround& whose = arguments.ground;
  if (!whose.as_mapped) {
    GroundRules rules = whose.rules(up.direction, map.parameters().occupancy.resolution);
    rules.widest_unseen_m = whose.bridge.value_or(0);
    const GroundView ground(snapshot, map.octree(), rules);
    stairs = ground.stairs();
    options.gaps = ground.gaps();
    snapshot = ground.supported();
    without_ground = static_cast<std::size_t>(std::ranges::count_if(
        snapshot->surfaces, [](const SurfacePtr& surface) { return surface->polygons.empty(); }));
  }
  add_parts(map, *snapshot, options);
  options.stairs = std::move(stairs);
  export_surfaces(*snapshot, arguments.file, options);
  std::printf("%s: %zu surfaces%s\n", arguments.file.c_str(), snapshot->surfaces.size(),
              whose.as_mapped ? ", as mapped" : (", ground of a " + whose.robot).c_str());
  if (without_ground > 0)
    std::printf("no room on %zu of them: these have no polygons (--as-mapped has all)\n", without_ground);
}

void export_octree(const Map& map, const ExportArguments& arguments) {
  if (arguments.what != ExportArguments().what)
    throw Error(Error::Kind::usage, "--what", "an .ot holds the octree", "leave it out");
  const auto tree = to_octree(map.octree());
  write_ot(*tree, arguments.file, arguments.force);
  std::printf("%s: %zu leaves of %g m\n", arguments.file.c_str(), tree->getNumLeafNodes(),
              tree->getResolution());
}

/// Of the scans, with their time stamps, where the map's folder of them is still there.
std::vector<io::StampedPose> poses_of_scans(const LoadedMap& loaded) {
  std::vector<io::StampedPose> poses;
  if (loaded.scans.folder.empty()) return poses;
  for (const auto& file : io::kept_scans(loaded.scans.folder, loaded.map.size().scans, loaded.scans.marks))
    poses.emplace_back(*io::stamp_in_name(file), loaded.scans.poses[poses.size()]);
  return poses;
}

void export_mcap(const LoadedMap& loaded, const Up& up, const ExportArguments& arguments) {
  if (arguments.what != ExportArguments().what)
    throw Error(Error::Kind::usage, "--what", "an .mcap holds surfaces and poses", "leave it out");
  const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
  std::vector<io::StampedPose> poses;
  try {
    poses = poses_of_scans(loaded);
  } catch (const Error& error) {
    std::fprintf(stderr, "warning: %s; the file has no poses\n", error.what());
  }
  io::write_file(arguments.file, arguments.force,
                 [&](std::ostream& out) { io::write_foxglove(out, *snapshot, up.direction, poses); });
  std::printf("%s: %zu surfaces, %zu poses\n", arguments.file.c_str(), snapshot->surfaces.size(),
              poses.size());
}

void run_export(const ExportArguments& arguments) {
  require_apart("--to", arguments.file, files_of_map(arguments.map));
  const LoadedMap loaded = open_map(arguments.map);
  const Up up = up_in_force(loaded.map, arguments.up);
  if (arguments.file.ends_with('/'))
    export_for_nav2(loaded.map, up, arguments.ground, arguments.file, arguments.force);
  else if (io::ending_of(arguments.file) == ".ot")
    export_octree(loaded.map, arguments);
  else if (io::ending_of(arguments.file) == ".mcap")
    export_mcap(loaded, up, arguments);
  else if (const std::string ending = io::ending_of(arguments.file);
           ending == ".json" || ending == ".ply" || ending == ".glb")
    export_by_ending(loaded.map, up, arguments);
  else
    throw Error(Error::Kind::usage, arguments.file, "no such format",
                "end the name in .json, .ply, .glb, .ot or .mcap; Nav2's is a folder, FOLDER/");
}

}  // namespace

void add_export(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("export", export_description);
  const auto arguments = std::make_shared<ExportArguments>();
  verb->add_option("map", arguments->map, "map to export: name without ending, as given to map -o")
      ->required();
  verb->add_option("--to", arguments->file,
                   "file to write: .json, .ply, .glb, .ot or .mcap; a folder FOLDER/ is Nav2's")
      ->required();
  verb->add_option("--what", arguments->what,
                   "polygons, meshes, convex, points; several with commas for .json")
      ->delimiter(',')
      ->check(CLI::IsMember({"polygons", "meshes", "convex", "points"}))
      ->capture_default_str();
  verb->add_option("--thickness", arguments->thickness, "m: of --what meshes")
      ->check(more_than(0))
      ->capture_default_str();
  RobotGround& ground = arguments->ground;
  verb->add_option("--bridge", ground.bridge,
                   "m: widest unseen gap to close, where the spacing of the readings explains it, as between "
                   "a lidar's rings [0; for Nav2 a quarter of the foot]")
      ->check(between(0, widest_gap_m));
  verb->add_option("--robot", ground.robot,
                   "biped, quadruped or a JSON file: whose ground, clear of what is too near or too low for "
                   "it, and the map's resolution inside of edges")
      ->capture_default_str();
  verb->add_option("--unknown", ground.unknown,
                   "blocked or free: what space low over the ground is that nobody saw")
      ->check(CLI::IsMember({"blocked", "free"}))
      ->capture_default_str();
  verb->add_flag("--as-mapped", ground.as_mapped,
                 "outlines by the readings alone, which are no ground: with voids, obstacles and edges")
      ->excludes("--bridge");
  add_up_option(*verb, arguments->up);
  verb->add_flag("--force", arguments->force, "overwrite the file");
  add_nav2_options(*verb, ground);
  verb->callback([arguments] { run_export(*arguments); });
}

}  // namespace octosurf
