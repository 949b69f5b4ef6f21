// `octosurf explain`: why there is no surface at a place.
#include "open_map.hpp"
#include "readable.hpp"

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/explain.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* explain_description = R"(Says why there is no surface at a place.

Examples:
  octosurf explain maps/office --at 1.2 0.4 0.9
  octosurf explain maps/office --at 1.2 0.4 0.9 --json
)";

struct ExplainArguments {
  std::string map;
  std::vector<double> at;
  bool json = false;
};

Json json_of(const Explanation& why, const std::string& detector) {
  Json json;
  json["reason"] = reason_name(why.reason);
  json["sentence"] = why.sentence;
  json["asked"] = why.asked;
  json["looked_at"] = why.looked_at ? Json(*why.looked_at) : Json();
  json["detector"] = detector;
  json["surface"] = why.surface != 0 ? Json(why.surface) : Json();
  json["cylinder"] = why.cylinder != 0 ? Json(why.cylinder) : Json();
  json["nearest"] =
      why.nearest != 0 ? Json{{"surface", why.nearest}, {"distance_m", why.nearest_distance}} : Json();
  json["figures"] = Json::array();
  for (const Figure& figure : why.figures) {
    Json entry{{"name", figure.name}, {"value", figure.value}, {"unit", figure.unit}};
    if (figure.at_least) entry["at_least"] = *figure.at_least;
    json["figures"].push_back(std::move(entry));
  }
  json["around"] = Json::object();
  for (const auto& [reason, count] : why.around) json["around"][std::string(reason_name(reason))] = count;
  return json;
}

void run_explain(const ExplainArguments& arguments) {
  const LoadedMap loaded = open_map(arguments.map);
  const Explanation why = explain(loaded.map, Eigen::Vector3d(arguments.at.data()), paper_detector());
  const std::string detector = get_parameter(loaded.map.parameters(), "detector");
  print_answer(json_of(why, detector), arguments.json);
}

}  // namespace

void add_explain(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("explain", explain_description);
  const auto arguments = std::make_shared<ExplainArguments>();
  verb->add_option("map", arguments->map, "map to ask: name without ending, as given to map -o")->required();
  verb->add_option("--at", arguments->at, "X Y Z: the place, map frame, m")->expected(3)->required();
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_explain(*arguments); });
}

}  // namespace octosurf
