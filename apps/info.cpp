// `octosurf info`: what is in a map or a bag.
#include "io/exporters/stairs_json.hpp"
#include "io/readers/bag_index.hpp"
#include "open_map.hpp"
#include "readable.hpp"
#include "run_statistics.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

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
  octosurf info maps/office --digest     sixteen digits: the same for the same scans, however often it was saved
  octosurf info walk.mcap                topics of a bag (.bag, .db3, .mcap, or its folder)
)";

struct InfoArguments {
  std::string map, up;
  bool json = false, digest = false;
};

constexpr std::size_t listed_surfaces = 10;

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
  for (const CylinderPtr& cylinder : snapshot->cylinders) json["cylinders"].push_back(*cylinder);
  json["stairs"] = stairs.stairs;
  json["single_steps"] = stairs.single_steps;
  json["parameters"] = Json::parse(parameters_json(map.parameters()));
  json["warnings"] = Json::array();
  if (!loaded.warning.empty()) json["warnings"].push_back(loaded.warning);
  return json;
}

Json json_of(const std::string& bag, std::vector<std::string>& damage) {
  const auto files = io::files_of_bag(bag);
  std::vector<io::TopicContents> topics = io::summarise_bag(*io::open_bag(files), damage);
  std::ranges::sort(topics, {}, [](const io::TopicContents& one) { return one.topic.name; });
  std::uint64_t messages = 0;
  std::vector<std::int64_t> ends_ns;
  Json list = Json::array();
  const auto seconds = [](std::int64_t ns) { return static_cast<double>(ns) / 1e9; };
  for (const io::TopicContents& one : topics) {
    messages += one.messages;
    list.push_back({{"name", one.topic.name}, {"type", one.topic.type}, {"messages", one.messages}});
    list.back().update({{"first_s", nullptr}, {"last_s", nullptr}});
    if (one.messages == 0) continue;
    list.back().update({{"first_s", seconds(one.first_ns)}, {"last_s", seconds(one.last_ns)}});
    ends_ns.insert(ends_ns.end(), {one.first_ns, one.last_ns});
  }
  Json json{{"files", Json::array()}, {"messages", messages}};
  for (const auto& file : files) json["files"].push_back(file.string());
  json.update({{"first_s", nullptr}, {"last_s", nullptr}, {"duration_s", nullptr}});
  if (const auto [first, last] = std::ranges::minmax_element(ends_ns); !ends_ns.empty())
    json.update(
        {{"first_s", seconds(*first)}, {"last_s", seconds(*last)}, {"duration_s", seconds(*last - *first)}});
  json["topics"] = list;
  json["damage"] = damage;
  return json;
}

void run_info(const InfoArguments& arguments) {
  if (io::is_bag(arguments.map) ||
      (std::filesystem::is_directory(arguments.map) && !io::files_of_bag(arguments.map).empty())) {
    if (!arguments.up.empty())
      throw Error(Error::Kind::usage, arguments.map, "a bag, and --up is of maps", "leave it away");
    std::vector<std::string> damage;
    print_answer(json_of(arguments.map, damage), arguments.json);
    if (!damage.empty()) throw Error(Error::Kind::data, "", damage.front());
    return;
  }
  const LoadedMap loaded = load_with_warning(arguments.map);
  if (arguments.digest) return void(std::puts(digest_of(loaded.map).c_str()));
  print_answer(json_of(loaded, arguments.up), arguments.json);
}

}  // namespace

void add_info(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("info", info_description);
  const auto arguments = std::make_shared<InfoArguments>();
  verb->add_option("map", arguments->map, "map: name without ending, as given to map -o; or a bag")
      ->required();
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->add_flag("--digest", arguments->digest, "print only the digest of the map's content");
  verb->callback([arguments] { run_info(*arguments); });
}

}  // namespace octosurf
