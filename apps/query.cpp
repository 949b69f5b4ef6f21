// `octosurf query`: a planner's questions from the shell.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

constexpr const char* description = R"(Answers a planner's questions about a map.

Examples:
  octosurf query maps/office --nearest 1.2 0.4 0.9
  octosurf query maps/office --nearest 1.2 0.4 0.9 --json
)";

struct Arguments {
  std::string map;
  std::vector<double> nearest;
  bool json = false;
};

void print(const Nearest& found, const Surface& surface) {
  const Eigen::Vector3d &p = found.point, &n = surface.plane.normal;
  std::printf("surface   %u\n", found.id);
  std::printf("point     %.4f %.4f %.4f\n", p.x(), p.y(), p.z());
  std::printf("distance  %.4f m\n", found.distance);
  std::printf("normal    %.4f %.4f %.4f\n", n.x(), n.y(), n.z());
  std::printf("area      %.3f m²\n", surface.area_m2);
}

void print_json(const Nearest& found, const Surface& surface) {
  const Eigen::Vector3d &p = found.point, &n = surface.plane.normal;
  nlohmann::ordered_json json;
  json["surface"] = found.id;
  json["point"] = {p.x(), p.y(), p.z()};
  json["distance_m"] = found.distance;
  json["normal"] = {n.x(), n.y(), n.z()};
  json["area_m2"] = surface.area_m2;
  std::printf("%s\n", json.dump().c_str());
}

void run(const Arguments& arguments) {
  const LoadedMap loaded = load_map(arguments.map);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  const std::shared_ptr<const Snapshot> snapshot = loaded.map.snapshot();
  const std::vector<double>& at = arguments.nearest;
  const auto found = nearest(*snapshot, {at[0], at[1], at[2]});
  if (!found) throw Error(Error::Kind::data, arguments.map, "has no surfaces", "map more scans first");
  const Surface& surface = *snapshot->find(found->id);
  arguments.json ? print_json(*found, surface) : print(*found, surface);
}

}  // namespace

void add_query(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("query", description);
  const auto arguments = std::make_shared<Arguments>();
  verb->add_option("map", arguments->map, "map to ask: name without ending, as given to map -o")->required();
  verb->add_option("--nearest", arguments->nearest,
                   "X Y Z: the place on a surface that is nearest to this point")
      ->expected(3)
      ->required();
  verb->add_flag("--json", arguments->json, "answer in JSON");
  verb->callback([arguments] { run(*arguments); });
}

}  // namespace octosurf
