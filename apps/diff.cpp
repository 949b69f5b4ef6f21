// `octosurf diff`: what changed between two maps.
#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "io/text_file.hpp"
#include "lineage.hpp"
#include "map_past.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/changes.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* diff_description = R"(Prints what changed between two maps.

Examples:
  octosurf diff maps/monday maps/tuesday          surfaces by their ids, if tuesday continues monday
  octosurf diff maps/mine maps/yours --by place   by where they lie, whoever made the maps
  octosurf diff maps/monday maps/tuesday --json
  octosurf diff maps/office@2026-11-20 maps/office         one map as it was then and as it is
)";

struct DiffArguments {
  std::string before, after, by = "auto";
  double tolerance = 0;
  bool json = false;
};

struct Move {
  double offset_m = 0, angle_rad = 0;
};
/// Of a plane, in the middle of its surface as it was.
Move move_of(const Surface& before, const Surface& after) {
  const Eigen::Vector3d &a = before.plane.normal, &b = after.plane.normal;
  return {-after.plane.signed_distance(before.T_map_surface.translation()) / b.dot(a),
          std::atan2(a.cross(b).norm(), a.dot(b))};
}

Json successors_json(const std::vector<MapChanges::Successor>& all, const char* before, const char* now) {
  Json list = Json::array();
  for (const MapChanges::Successor& successor : all)
    list.push_back({{before, successor.before}, {now, successor.now}});
  return list;
}

void print_json(const MapChanges& changes, const Snapshot& before, const Snapshot& after) {
  Json json;
  json["by"] = "ids";
  json["revision_before"] = changes.since;
  json["revision_after"] = changes.revision;
  const auto listed = [](const std::vector<SurfaceId>& ids, const Snapshot& snapshot) {
    Json list = Json::array();
    for (const SurfaceId id : ids) list.push_back({{"id", id}, {"area_m2", snapshot.find(id)->area_m2}});
    return list;
  };
  json["appeared"] = listed(changes.appeared, after);
  json["changed"] = Json::array();
  for (const SurfaceId id : changes.changed) {
    const Surface &was = *before.find(id), &is = *after.find(id);
    const Move move = move_of(was, is);
    json["changed"].push_back({{"id", id},
                               {"area_before_m2", was.area_m2},
                               {"area_after_m2", is.area_m2},
                               {"offset_m", move.offset_m},
                               {"angle_deg", move.angle_rad * deg_per_rad}});
  }
  json["gone"] = listed(changes.gone, before);
  json["merged"] = successors_json(changes.merged, "id", "into");
  json["split"] = successors_json(changes.split, "id", "part");
  json["cylinders"] = {{"appeared", changes.cylinders_appeared},
                       {"changed", changes.cylinders_changed},
                       {"gone", changes.cylinders_gone}};
  json["cylinders"]["merged"] = successors_json(changes.cylinders_merged, "id", "into");
  std::printf("%s\n", json.dump(1).c_str());
}

void print(const MapChanges& changes, const Snapshot& before, const Snapshot& after) {
  std::printf(
      "revision %llu to %llu: %zu surfaces appeared, %zu changed, %zu gone, %zu merged, %zu split off\n",
      static_cast<unsigned long long>(changes.since), static_cast<unsigned long long>(changes.revision),
      changes.appeared.size(), changes.changed.size(), changes.gone.size(), changes.merged.size(),
      changes.split.size());
  for (const SurfaceId id : changes.appeared)
    std::printf("appeared  %6u  %8.3f m²\n", id, after.find(id)->area_m2);
  for (const SurfaceId id : changes.gone)
    std::printf("gone      %6u  %8.3f m²\n", id, before.find(id)->area_m2);
  for (const MapChanges::Successor& successor : changes.merged)
    std::printf("merged    %6u  into %u\n", successor.before, successor.now);
  for (const MapChanges::Successor& successor : changes.split)
    std::printf("split     %6u  a part is %u\n", successor.before, successor.now);
  for (const SurfaceId id : changes.changed) {
    const Surface &was = *before.find(id), &is = *after.find(id);
    const Move move = move_of(was, is);
    std::printf("changed   %6u  %8.3f m² to %.3f, moved %.1f mm, turned %.2f°\n", id, was.area_m2, is.area_m2,
                move.offset_m * 1000, move.angle_rad * deg_per_rad);
  }
  for (const CylinderId id : changes.cylinders_appeared) std::printf("appeared  cylinder %u\n", id);
  for (const CylinderId id : changes.cylinders_changed) std::printf("changed   cylinder %u\n", id);
  for (const CylinderId id : changes.cylinders_gone) std::printf("gone      cylinder %u\n", id);
  for (const MapChanges::Successor& successor : changes.cylinders_merged)
    std::printf("merged    cylinder %u into %u\n", successor.before, successor.now);
}

double unshared(const std::vector<SurfaceDifference>& surfaces) {
  double area = 0;
  for (const SurfaceDifference& one : surfaces) area += one.area_m2 - one.shared_m2;
  return area;
}

Json place_json(const std::vector<SurfaceDifference>& surfaces) {
  Json list = Json::array();
  for (const SurfaceDifference& one : surfaces) {
    Json& json = list.emplace_back(Json{{"id", one.id},
                                        {"area_m2", one.area_m2},
                                        {"shared_m2", one.shared_m2},
                                        {"free_m2", one.free_m2},
                                        {"unseen_m2", one.unseen_m2},
                                        {"other", nullptr}});
    if (one.other == 0) continue;
    json["other"] = one.other;
    json["offset_m"] = one.offset_m;
    json["angle_deg"] = one.angle_rad * deg_per_rad;
  }
  return list;
}

void print_json(const MapDifference& difference) {
  Json json;
  json["by"] = "place";
  json["only_before_m2"] = unshared(difference.before);
  json["only_after_m2"] = unshared(difference.after);
  json["before"] = place_json(difference.before);
  json["after"] = place_json(difference.after);
  std::printf("%s\n", json.dump(1).c_str());
}

double percent(double part, double area) { return area > 0 ? 100 * part / area : 0; }

/// `free`: the label of space observed as free in the other map.
void print(const char* label, const char* free, const std::vector<SurfaceDifference>& surfaces) {
  for (const SurfaceDifference& one : surfaces) {
    std::printf("%-7s %6u  %8.3f m², %5.1f %% in both", label, one.id, one.area_m2,
                percent(one.shared_m2, one.area_m2));
    if (const double share = percent(one.free_m2, one.area_m2); share >= 0.05)
      std::printf(", %.1f %% %s", share, free);
    if (const double share = percent(one.unseen_m2, one.area_m2); share >= 0.05)
      std::printf(", %.1f %% not seen by the other", share);
    if (one.other != 0)
      std::printf(", mostly %u: %.1f mm and %.2f° off", one.other, one.offset_m * 1000,
                  one.angle_rad * deg_per_rad);
    std::printf("\n");
  }
}

void print(const MapDifference& difference) {
  double gone = 0, appeared = 0;
  for (const SurfaceDifference& one : difference.before) gone += one.free_m2;
  for (const SurfaceDifference& one : difference.after) appeared += one.free_m2;
  std::printf(
      "by place: %.3f m² are in the first map only, %.3f m² of it seen free by the second; "
      "%.3f m² in the second only, %.3f m² of it seen free by the first\n",
      unshared(difference.before), gone, unshared(difference.after), appeared);
  print("first", "gone", difference.before);
  print("second", "new", difference.after);
}

void run_diff(const DiffArguments& arguments) {
  const LoadedMap first = load_map_at(arguments.before), second = load_map_at(arguments.after);
  for (const LoadedMap* loaded : {&first, &second})
    if (!loaded->warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded->warning.c_str());
  if (first.map.origin() != second.map.origin())
    throw Error(Error::Kind::data, arguments.after,
                "its origin is " + io::text_of(second.map.origin()) + ", the other's " +
                    io::text_of(first.map.origin()),
                "map both with the same --origin");
  const Snapshot &before = *first.map.snapshot(), &after = *second.map.snapshot();
  const bool lineage = arguments.by != "place" && goes_on_from(after, before);
  if (arguments.by == "ids" && !lineage)
    throw Error(Error::Kind::data, arguments.after, "does not go on from " + arguments.before,
                "compare them --by place");
  if (lineage) {
    const MapChanges changes = changes_since(after, before.revision);
    arguments.json ? print_json(changes, before, after) : print(changes, before, after);
  } else {
    const MapDifference difference =
        compare_maps(with_octree(before, first.map.octree()), with_octree(after, second.map.octree()),
                     arguments.tolerance);
    arguments.json ? print_json(difference) : print(difference);
  }
}

}  // namespace

void add_diff(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("diff", diff_description);
  const auto arguments = std::make_shared<DiffArguments>();
  verb->add_option("before", arguments->before,
                   "map: name without ending, as given to map -o; NAME@DATE: as it was then (see log)")
      ->required();
  verb->add_option("after", arguments->after, "another, or the same one later")->required();
  verb->add_option("--by", arguments->by,
                   "ids: which surface became which, if the second map continues the first; place: how much "
                   "of each surface both maps have; auto: ids if possible")
      ->check(CLI::IsMember({"auto", "ids", "place"}))
      ->capture_default_str();
  verb->add_option("--tolerance", arguments->tolerance,
                   "m: --by place: largest distance between two surfaces of one place [twice the coarser d]")
      ->check(more_than(0));
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_diff(*arguments); });
}

}  // namespace octosurf
