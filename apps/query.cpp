// `octosurf query`: a planner's questions from the shell.
#include "answers.hpp"
#include "bounds.hpp"
#include "contact_query.hpp"
#include "geometry/degrees.hpp"
#include "io/exporters/stairs_json.hpp"
#include "open_map.hpp"
#include "place_query.hpp"
#include "surface_table.hpp"
#include "up_option.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/planning.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf {
namespace {

constexpr const char* query_description = R"(Answers questions about a map.

Examples:
  octosurf query maps/office --nearest 1.2 0.4 0.9
  octosurf query maps/office --nearest 1.2 0.4 0.9 --max-slope 30   of what slopes by 30 degrees at most
  octosurf query maps/office --below 1.2 0.4 0.9 --json             what a foot lowered there meets
  octosurf query maps/office --ray 0 0 1.5 1 0 -0.2                 what a camera at 1.5 m looks at
  octosurf query maps/office --box 0 0 0 2 2 1 --json               ids of the surfaces in there; --sphere X Y Z R
  octosurf query maps/office --voxel 1.2 0.4 0.9                    occupied, free or unknown, and its surface
  octosurf query maps/office --foothold 1.2 0.4 0.0 90 --foot 0.22x0.11 --clearance 0.15 --edge-margin 0.02
  octosurf query maps/office --stair 1.2 0.4 0.0 --json             the stair nearest to that place
  octosurf query maps/office --regions 7 --foot 0.03 --pieces 12 --json   where a ball foot may be on surface 7
  octosurf query maps/office --regions 7 --foot 0.03 --about 1.2 0.4 0.0 --reach 1   likewise, within a metre of a place
)";

struct QueryArguments {
  std::string map, up;
  std::vector<double> nearest, below, stair;
  std::optional<double> max_slope_deg;
  PlaceQuery place;
  ContactQuery contact;
  bool json = false;
};

void print(const Nearest& found, const Surface& surface, const Eigen::Vector3d& up) {
  const Eigen::Vector3d &p = found.point, &n = surface.plane.normal;
  std::printf("surface   %u\n", found.id);
  std::printf("point     %.4f %.4f %.4f\n", p.x(), p.y(), p.z());
  std::printf("distance  %.4f m\n", found.distance);
  std::printf("normal    %.4f %.4f %.4f\n", n.x(), n.y(), n.z());
  std::printf("slope     %.2f°\n", slope_rad(surface, up) * deg_per_rad);
  std::printf("area      %.3f m²\n", surface.area_m2);
}

/// The stair nearest to a place.
void answer_stair(const Snapshot& snapshot, const QueryArguments& arguments, const Eigen::Vector3d& up) {
  const Stairs found = find_stairs(snapshot, up);
  const std::vector<double>& at = arguments.stair;
  const Stair* stair = nearest_stair(snapshot, found.stairs, {at[0], at[1], at[2]});
  if (stair == nullptr) throw Error(Error::Kind::data, arguments.map, "has no stair", "map more of it first");
  if (arguments.json)
    std::printf("%s\n", io::stair_json(*stair).c_str());
  else
    print_table(std::vector<Stair>{*stair});
}

void run_query(const QueryArguments& arguments) {
  const LoadedMap loaded = open_map(arguments.map);
  const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
  warn_of_up(loaded.map, arguments.up);
  const Eigen::Vector3d up = up_in_force(loaded.map, arguments.up).direction;
  if (arguments.place.asked()) return answer(loaded.map, arguments.place, up, arguments.json);
  if (arguments.contact.asked()) {
    const auto edges_of = [&](const Surface& surface) { return label_edges(loaded.map, surface); };
    ContactQuery query = arguments.contact;
    if (arguments.max_slope_deg) query.max_slope_rad = *arguments.max_slope_deg * rad_per_deg;
    return answer({arguments.map, snapshot, loaded.map.octree(), up, edges_of}, query, arguments.json);
  }
  if (!arguments.stair.empty()) return answer_stair(*snapshot, arguments, up);
  const SlopeLimit limit{up, arguments.max_slope_deg.value_or(180) / deg_per_rad};
  const bool lowered = !arguments.below.empty();
  const std::vector<double>& at = lowered ? arguments.below : arguments.nearest;
  const Eigen::Vector3d point(at[0], at[1], at[2]);
  const auto found = lowered ? below(*snapshot, point, limit) : nearest(*snapshot, point, limit);
  if (!found)
    throw Error(Error::Kind::data, arguments.map,
                lowered ? "has no such surface below that place" : "has no such surfaces",
                "map more scans first, or allow a greater --max-slope");
  const Surface& surface = *snapshot->find(found->id);
  if (arguments.json)
    std::printf("%s\n", nearest_json(*found, surface, up).c_str());
  else
    print(*found, surface, up);
}

}  // namespace

void add_query(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("query", query_description);
  const auto arguments = std::make_shared<QueryArguments>();
  verb->add_option("map", arguments->map, "map to ask: name without ending, as given to map -o")->required();
  CLI::Option_group* question = verb->add_option_group("question", "question; one of");
  question->add_option("--nearest", arguments->nearest, "X Y Z: the nearest point on a surface")->expected(3);
  question->add_option("--below", arguments->below, "X Y Z: the first surface straight below this point")
      ->expected(3);
  question
      ->add_option("--stair", arguments->stair,
                   "X Y Z: the stair nearest to this point: risers, treads, width, heading")
      ->expected(3);
  add_place_options(*question, arguments->place);
  add_contact_options(*verb, *question, arguments->contact);
  question->require_option(1);
  verb->add_option("--max-slope", arguments->max_slope_deg,
                   "degrees: leave out steeper surfaces; 90 leaves out ceilings [180; of a foot 30]")
      ->check(between(0, 180));
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_query(*arguments); });
}

}  // namespace octosurf
