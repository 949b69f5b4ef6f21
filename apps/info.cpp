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
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>
#include <octosurf/stairs.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* info_description = R"(Prints what is in a map, or in a recording.

Examples:
  octosurf info maps/office
  octosurf info maps/office --json
  octosurf info walk.mcap                topics of a bag (.bag, .db3, .mcap, or its folder)
  octosurf info kitchen                  scans of a folder, and how its first is read
)";

struct InfoArguments {
  std::string map, up;
  bool json = false;
};

constexpr std::size_t listed_surfaces = 10;

struct Contents {
  Map::Size size;
  std::shared_ptr<const Snapshot> snapshot;
  Up up;
  Stairs stairs;
  Eigen::AlignedBox3d extent;  ///< of the points, map frame; empty if there is none
};

Contents look_into(const Map& map, const std::string& up) {
  Contents contents{map.size(), map.snapshot(), up_in_force(map, up), {}, {}};
  contents.stairs = find_stairs(*contents.snapshot, contents.up.direction);
  map.for_each_point([&](const OccupancyView::Voxel& voxel) { contents.extent.extend(voxel.point); });
  return contents;
}

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

Json json_of(const LoadedMap& loaded, const Contents& contents) {
  const Map& map = loaded.map;
  const Map::Size& size = contents.size;
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
  if (!contents.extent.isEmpty())
    json["extent"] = {{"min", contents.extent.min()}, {"max", contents.extent.max()}};
  if (!map.origin().isZero(0)) json["origin"] = map.origin();
  json["up"] = {{"direction", contents.up.direction}, {"from", name_of(contents.up.source)}};
  json["surfaces"] = size.surfaces;
  json["area_m2"] = total_area(*contents.snapshot);
  json["largest"] = largest_surfaces(*contents.snapshot, listed_surfaces, contents.up.direction);
  json["cylinders"] = Json::array();
  for (const CylinderPtr& cylinder : contents.snapshot->cylinders)
    json["cylinders"].push_back(to_json(*cylinder));
  json["stairs"] = contents.stairs.stairs;
  json["steps"] = contents.stairs.single_steps;
  json["parameters"] = Json::parse(parameters_json(map.parameters()));
  json["warnings"] = Json::array();
  if (!loaded.warning.empty()) json["warnings"].push_back(loaded.warning);
  return json;
}

std::string scalar_text(const Json& json) {
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// Of a folder of scans: how many, what the first is like, and what was chosen.
void print_scans(const InfoArguments& arguments) {
  if (arguments.json || !arguments.up.empty())
    throw Error(Error::Kind::usage, arguments.map, "a folder of scans, and --json and --up are of maps",
                "leave them away");
  const std::unique_ptr<ScanSource> source = open_scans({arguments.map}, {});
  std::printf("%-12s %zu\n", "scans", source->size());
  const std::optional<Scan> first = source->next();
  if (!first) return;
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0;
  std::size_t finite = 0;
  for (const Eigen::Vector3f& point : first->points) {
    if (!point.allFinite()) continue;
    ++finite;
    nearest = std::min(nearest, point.norm());
    farthest = std::max(farthest, point.norm());
  }
  const bool posed = first->T_map_sensor.matrix() != Eigen::Isometry3d::Identity().matrix();
  std::printf("%-12s %s of a %s, %s\n", "first", first->name.c_str(),
              first->sensor == SensorKind::lidar ? "lidar, or a cloud" : "depth camera",
              posed ? "with its pose" : "without a pose, or at the origin");
  std::printf("%-12s %zu of %zu points", "readings", finite, first->points.size());
  if (finite > 0) std::printf(", from %.2f to %.2f m", nearest, farthest);
  std::printf("\n");
  for (const std::string& note : source->notes()) std::printf("%-12s %s\n", "chosen", note.c_str());
}

void run_info(const InfoArguments& arguments) {
  if (io::is_bag(arguments.map)) {
    if (!arguments.up.empty())
      throw Error(Error::Kind::usage, arguments.map, "a bag, and --up is of maps", "leave it away");
    return print_bag(arguments.map, arguments.json);
  }
  if (std::filesystem::is_directory(arguments.map)) return print_scans(arguments);
  const LoadedMap loaded = load_map(arguments.map);
  const Contents contents = look_into(loaded.map, arguments.up);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  const Json json = json_of(loaded, contents);
  if (arguments.json)
    std::fputs(scalar_text(json).c_str(), stdout);
  else
    print_readable(json);
}

}  // namespace

std::string info_json(const LoadedMap& loaded, const std::string& up) {
  return scalar_text(json_of(loaded, look_into(loaded.map, up)));
}

void add_info(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("info", info_description);
  const auto arguments = std::make_shared<InfoArguments>();
  verb->add_option("map", arguments->map,
                   "map: name without ending, as given to map -o; or a bag, or a folder of scans")
      ->required();
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_info(*arguments); });
}

}  // namespace octosurf
