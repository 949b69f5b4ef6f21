// `octosurf query`: a planner's questions from the shell.
#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "open_map.hpp"
#include "plan_query.hpp"
#include "questions.hpp"
#include "readable.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

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
  octosurf query maps/office --patch 1.2 0.4 0.6 90                 heights around a robot's base, as its controller reads
  octosurf query maps/office --regions 1 --foot 0.03 --pieces 12 --json   where a ball foot may be on surface 1
  octosurf query maps/office --regions 1 --foot 0.03 --about 1.2 0.4 0.0 --reach 1   likewise, within a metre of a place
)";

struct QueryArguments {
  std::string map, up;
  const Question* question = nullptr;
  Request asked;
  bool json = false;
};

void run_query(QueryArguments& arguments) {
  const LoadedMap loaded = open_map(arguments.map);
  const planning::AskedMap map = asked_map(loaded, arguments.map, arguments.up);
  const Question& question = *arguments.question;
  if (!arguments.json && question.print != nullptr) return question.print(map, arguments.asked);
  const nlohmann::ordered_json answer = question.answer(map, arguments.asked);
  if (!arguments.json) return print_readable(answer);
  std::printf("%s\n", answer.dump().c_str());
}

void add_contact_options(CLI::App& verb, planning::ContactQuestion& question) {
  add_robot_options(verb, question.robot, question.foot, question.unknown_is_free);
  const auto metres = [&](const char* name, std::optional<double>& to, const char* description) {
    verb.add_option(name, to, description)->check(at_least(0));
  };
  const auto degrees = [&](const char* name, std::optional<double>& to, double low, double high,
                           const char* description) {
    verb.add_option_function<double>(
            name, [&to](double given) { to = given * rad_per_deg; }, description)
        ->check(between(low, high));
  };
  degrees("--max-slope", question.max_slope_rad, 0, 180,
          "degrees: leave out steeper surfaces; 90 leaves out ceilings [180; of a foot 30]");
  metres("--edge-margin", question.edge_margin_m, "m: from the foot to every edge [the map's resolution]");
  metres("--obstacle-margin", question.obstacle_margin_m,
         "m: from the foot to obstacles up to the clearance [the map's resolution]");
  metres("--clearance", question.clearance_m,
         "m: height over the foot that must be clear; 0: not checked [the robot's height]");
  verb.add_flag("--as-mapped", question.as_mapped,
                "outlines of the readings, which are no ground: without margins, clearance and voids");
  verb.add_option("--unseen", question.unseen_share,
                  "widest unseen gap that a foot may span, as a share of its narrower side")
      ->check(between(0, 1))
      ->capture_default_str();
  degrees("--yaw", question.yaw_rad, -3600, 3600, "heading of the foot, degrees [any heading]");
  verb.add_option("--pieces", question.pieces, "also the region as at most N convex pieces")
      ->capture_default_str();
  verb.add_option_function<std::vector<double>>(
          "--about",
          [&question](const std::vector<double>& given) { question.at = Eigen::Vector3d(given.data()); },
          "X Y Z: of the region only what is near this place [all of it]")
      ->expected(3);
  verb.add_option("--reach", question.reach_m, "m: from a place, along the surface's axes")
      ->check(at_least(0.001))
      ->capture_default_str();
}

}  // namespace

void add_query(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("query", query_description);
  const auto arguments = std::make_shared<QueryArguments>();
  verb->add_option("map", arguments->map, "map to ask: name without ending, as given to map -o")->required();
  CLI::Option_group* group = verb->add_option_group("question", "question; one of");
  constexpr double farthest_m = 1e6;  // octrees end before, and numbers still keep their micrometres there
  for (const Question& question : questions()) {
    const auto take = [arguments, &question](const std::vector<double>& numbers) {
      arguments->question = &question;
      arguments->asked.numbers = numbers;
    };
    CLI::Option* option = group->add_option_function<std::vector<double>>(
        std::string("--") + question.flag, take, question.takes + std::string(": ") + question.summary);
    option->expected(question.numbers);
    if (question.numbers > 1) option->check(between(-farthest_m, farthest_m).description(""));
  }
  group->require_option(1);
  add_contact_options(*verb, arguments->asked.contact);
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_query(*arguments); });
}

}  // namespace octosurf
