// `octosurf plan`: footsteps over a map.
#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "io/new_file.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "plan_query.hpp"
#include "planning/questions.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>
#include <octosurf/footsteps.hpp>
#include <octosurf/plan_files.hpp>

namespace octosurf {
namespace {

constexpr const char* plan_description =
    R"(Plans footsteps from one place to another, or says what is in the way.

Examples:
  octosurf plan maps/office --from -4.6 -0.6 0.6 -135 --to -6.6 -2.7 1.5 -135
  octosurf plan maps/office --from -4.6 -0.6 0.6 -135 --to -6.6 -2.7 1.5 -135 --png steps.png -o steps.glb -o steps.json
  octosurf plan maps/office --from -4.6 -0.6 0.6 -135 --to -5.0 0.0 0.6 -135 --foot 0.26x0.13 --robot ours.json
  octosurf plan maps/stairs --from -3.45 0.74 0.57 -133 --to -5.6 -1.55 1.7 -133 --robot quadruped

X Y Z is on the ground between the feet, YAW in degrees, counter-clockwise from the map's x axis seen from
above. Feet are put on the footholds nearest to there. Where feet and swinging legs would be nothing may be
unknown (--unknown free), while for the body unknown space counts as free. A file of --robot is
{"robot": "biped"} or "quadruped", and which of its limits differ: "foot": "0.26x0.13", "max_forward_m": 0.45.
)";

struct PlanArguments {
  std::string map, up, png;
  PlanQuery query;
  std::vector<std::string> outputs;
  bool json = false, force = false;
};

void print(const FootstepPlan& plan) {
  std::set<SurfaceId> surfaces;
  for (const Footstep& step : plan.steps) surfaces.insert(step.surface);
  double way = 0;
  for (std::size_t i = 1; i < plan.body.size(); ++i) way += (plan.body[i].at - plan.body[i - 1].at).norm();
  std::printf("%zu steps over %zu surfaces, %.2f m\n", plan.steps.size(), surfaces.size(), way);
  std::printf("cost %.2f; none on the planner's grid costs less than %.2f\n", plan.cost, plan.lower_bound);
  std::printf("%zu expansions, %.0f ms\n\n", plan.expansions, plan.search_ms);
  std::printf(" step  foot         surface        x        y        z      yaw   margin\n");
  const auto line = [](const std::string& number, const Footstep& step) {
    const Eigen::Vector3d p = step.T_map_foot.translation();
    std::printf("%5s  %-11s  %7ju  %7.3f  %7.3f  %7.3f  %6.1f°  %6.3f\n", number.c_str(),
                foot_name(step.foot).data(), step.surface, p.x(), p.y(), p.z(),
                std::remainder(step.yaw_rad / rad_per_deg, 360.0), step.margin_m);
  };
  for (const Footstep& step : plan.start) line("start", step);
  for (std::size_t i = 0; i < plan.steps.size(); ++i) line(std::to_string(i + 1), plan.steps[i]);
}

void write(const PlanArguments& arguments, const Snapshot& snapshot, const FootstepPlan& plan,
           const Robot& robot, const Eigen::Vector3d& up) {
  for (const std::string& file : arguments.outputs) {
    if (file.ends_with(".json")) {
      io::write_file(file, arguments.force, [&](std::ostream& out) { out << to_json(plan, robot) << '\n'; });
    } else if (plan.found()) {
      ExportOptions options;
      options.up = up;
      options.force = arguments.force;
      options.meshes = footprints(plan, robot);
      export_surfaces(snapshot, file, options);
    }
  }
  if (arguments.png.empty() || !plan.found()) return;
  PictureOptions picture;
  picture.up = up;
  picture.force = arguments.force;
  picture.meshes = footprints(plan, robot);
  render_png(snapshot, arguments.png, picture);
}

void require_sensible_files(const PlanArguments& arguments) {
  for (const std::string& file : arguments.outputs) {
    require_apart("-o", file, files_of_map(arguments.map));
    if (!file.ends_with(".json") && !file.ends_with(".glb"))
      throw Error(Error::Kind::usage, "-o " + file, "is neither .json nor .glb", "give it such an ending");
  }
  require_apart("--png", arguments.png, files_of_map(arguments.map));
}

void run_plan(PlanArguments& arguments) {
  require_sensible_files(arguments);
  const LoadedMap map = open_map(arguments.map);
  const planning::AskedMap asked(arguments.map, map.map.snapshot(), map.map.octree(),
                                 up_in_force(map.map, arguments.up).direction);
  const PlanQuery& query = arguments.query;
  const Robot robot = robot_of(query, asked.up);
  const auto solid = asked.ground(GroundRules::of(robot, asked.octree.resolution())).solid();
  const FootstepPlan plan =
      FootstepPlanner(solid, asked.octree, robot).plan(query.from, query.to, query.budget);
  write(arguments, *solid, plan, robot, asked.up);
  if (arguments.json) std::printf("%s\n", to_json(plan, robot).c_str());
  if (!plan.found()) throw Error(Error::Kind::data, arguments.map, plan.refusal->sentence);
  if (!arguments.json) print(plan);
}

}  // namespace

void add_plan(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("plan", plan_description);
  const auto arguments = std::make_shared<PlanArguments>();
  verb->add_option("map", arguments->map, "map to walk on: name without ending, as given to map -o")
      ->required();
  PlanQuery& query = arguments->query;
  const auto add_standing = [verb](const char* name, Standing& to, const char* description) {
    verb->add_option_function<std::vector<double>>(
            name,
            [&to](const std::vector<double>& v) {
              to = {{v[0], v[1], v[2]}, v[3] * rad_per_deg};
            },
            description)
        ->expected(4)
        ->required();
  };
  add_standing("--from", query.from,
               "X Y Z YAW: start, on the ground between the feet, and the heading, degrees");
  add_standing("--to", query.to, "X Y Z YAW: goal");
  add_robot_options(*verb, query.robot, query.foot, query.unknown_is_free);
  add_up_option(*verb, arguments->up);
  verb->add_option("--seconds,--time", query.budget.time_s, "most seconds of search [no limit]")
      ->check(at_least(0));
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->add_option(
          "-o,--output", arguments->outputs,
          "FILE.json: the plan, or why there is none; FILE.glb: surfaces and footprints for a 3-D viewer; "
          "may be repeated")
      ->type_name("FILE");
  verb->add_option("--png", arguments->png, "picture of surfaces and footprints: left red, right green")
      ->type_name("FILE");
  verb->add_flag("--force", arguments->force, "overwrite files");
  verb->callback([arguments] { run_plan(*arguments); });
}

}  // namespace octosurf
