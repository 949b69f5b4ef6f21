// `octosurf info`: what is in a map or a bag.
#include "info.hpp"

#include "io/exporters/stairs_json.hpp"
#include "io/readers/bag.hpp"
#include "readable.hpp"
#include "run_statistics.hpp"
#include "surface_table.hpp"
#include "up_option.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* info_description = R"(Prints what is in a map, or in a bag.

Examples:
  octosurf info maps/office
  octosurf info maps/office --json
  octosurf info walk.mcap                topics of a bag (.bag, .db3, .mcap, or its folder)
)";

struct InfoArguments {
  std::string map, up;
  bool json = false;
};

constexpr std::size_t listed_surfaces = 10;

Json to_json(const Cylinder& cylinder) {
  return {{"id", cylinder.id},
          {"axis_point", cylinder.axis_point},
          {"axis", cylinder.axis},
          {"radius_m", cylinder.radius_m},
          {"length_m", cylinder.length_m},
          {"span_deg", cylinder.span_rad * 180 / std::numbers::pi},
          {"inliers", cylinder.inliers},
          {"rms_m", cylinder.rms_m}};
}

Json json_of(const LoadedMap& loaded, const std::string& up_option) {
  const Map& map = loaded.map;
  const Map::Size size = map.size();
  const std::shared_ptr<const Snapshot> snapshot = map.snapshot();
  const Up up = up_in_force(map, up_option);
  const Stairs stairs = find_stairs(*snapshot, up.direction);
  Eigen::AlignedBox3d extent;
  map.for_each_point([&](const OccupancyView::Voxel& voxel) { extent.extend(voxel.point); });
  Json json;
  json["resolution"] = map.parameters().occupancy.resolution;
  json["scans"] = size.scans;
  json["kept_scans"] = loaded.scans.folder.empty() ? Json() : Json(loaded.scans.folder.string());
  json["revision"] = size.revision;
  json["octree"] = {{"nodes", size.nodes}, {"leaves", size.leaves}, {"bytes", size.bytes}};
  json["points"] = size.points;
  json["inliers"] = size.inliers;
  json["pending_points"] = size.pending;
  json["extent"] = nullptr;
  if (!extent.isEmpty()) json["extent"] = {{"min", extent.min()}, {"max", extent.max()}};
  if (!map.origin().isZero(0)) json["origin"] = map.origin();
  json["up"] = {{"direction", up.direction}, {"from", name_of(up.source)}};
  json["surfaces"] = size.surfaces;
  json["area_m2"] = total_area(*snapshot);
  json["largest"] = largest_surfaces(*snapshot, listed_surfaces, up.direction);
  json["cylinders"] = Json::array();
  for (const CylinderPtr& cylinder : snapshot->cylinders) json["cylinders"].push_back(to_json(*cylinder));
  json["stairs"] = stairs.stairs;
  json["steps"] = stairs.single_steps;
  json["parameters"] = Json::parse(parameters_json(map.parameters()));
  json["warnings"] = Json::array();
  if (!loaded.warning.empty()) json["warnings"].push_back(loaded.warning);
  return json;
}

void run_info(const InfoArguments& arguments) {
  if (io::is_bag(arguments.map)) {
    if (!arguments.up.empty())
      throw Error(Error::Kind::usage, arguments.map, "a bag, and --up is of maps", "leave it away");
    return print_bag(arguments.map, arguments.json);
  }
  const LoadedMap loaded = load_map(arguments.map);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  print_answer(json_of(loaded, arguments.up), arguments.json);
}

}  // namespace

std::string info_json(const LoadedMap& loaded, const std::string& up) {
  return json_of(loaded, up).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void add_info(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("info", info_description);
  const auto arguments = std::make_shared<InfoArguments>();
  verb->add_option("map", arguments->map, "map: name without ending, as given to map -o; or a bag")
      ->required();
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_info(*arguments); });
}

}  // namespace octosurf
