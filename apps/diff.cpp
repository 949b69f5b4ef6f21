// `octosurf diff`: what changed between two maps.
#include "geometry/degrees.hpp"
#include "io/text_file.hpp"
#include "open_map.hpp"
#include "readable.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <octosurf/changes.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* diff_description =
    R"(Prints what changed between a map and one that goes on from it.

Examples:
  octosurf diff maps/monday maps/tuesday
  octosurf diff maps/monday maps/tuesday --json
)";

struct DiffArguments {
  std::string before, after;
  bool json = false;
};

/// Whether `after` is a later state of `before`: everything in `before` is in `after` or was removed since,
/// and nothing else is as old.
bool goes_on_from(const Snapshot& after, const Snapshot& before) {
  if (before.revision > after.revision) return false;
  std::vector<SurfaceId> left;
  after.removals.for_each_since(before.revision, [&](const Removal& removal) {
    if (removal.of == Removal::Of::surface && removal.born <= before.revision) left.push_back(removal.id);
  });
  std::ranges::sort(left);
  std::size_t there = 0;
  for (const SurfacePtr& surface : before.surfaces) {
    const Surface* now = after.find(surface->id);
    if (now == nullptr && !std::ranges::binary_search(left, surface->id)) return false;
    if (now != nullptr && now->born != surface->born) return false;
    there += now != nullptr;
  }
  const auto as_old =
      std::ranges::count_if(after.surfaces, [&](const SurfacePtr& s) { return s->born <= before.revision; });
  return static_cast<std::size_t>(as_old) == there;
}

Json successors_json(const std::vector<MapChanges::Successor>& all, const char* before, const char* now) {
  Json list = Json::array();
  for (const MapChanges::Successor& successor : all)
    list.push_back({{before, successor.before}, {now, successor.now}});
  return list;
}

Json json_of(const MapChanges& changes, const Snapshot& before, const Snapshot& after) {
  Json json;
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
    const Eigen::Vector3d &a = was.plane.normal, &b = is.plane.normal,
                          middle = was.T_map_surface.translation();
    json["changed"].push_back({{"id", id},
                               {"area_before_m2", was.area_m2},
                               {"area_after_m2", is.area_m2},
                               {"offset_m", -is.plane.signed_distance(middle) / b.dot(a)},
                               {"angle_deg", std::atan2(a.cross(b).norm(), a.dot(b)) * deg_per_rad}});
  }
  json["gone"] = listed(changes.gone, before);
  json["merged"] = successors_json(changes.merged, "id", "into");
  json["split"] = successors_json(changes.split, "id", "part");
  json["cylinders"] = {{"appeared", changes.cylinders_appeared},
                       {"changed", changes.cylinders_changed},
                       {"gone", changes.cylinders_gone}};
  json["cylinders"]["merged"] = successors_json(changes.cylinders_merged, "id", "into");
  return json;
}

void run_diff(const DiffArguments& arguments) {
  const LoadedMap first = load_with_warning(arguments.before), second = load_with_warning(arguments.after);
  if (first.map.origin() != second.map.origin())
    throw Error(Error::Kind::data, arguments.after,
                "its origin is " + io::text_of(second.map.origin()) + ", the other's " +
                    io::text_of(first.map.origin()),
                "map both with the same --origin");
  const Snapshot &before = *first.map.snapshot(), &after = *second.map.snapshot();
  if (!goes_on_from(after, before))
    throw Error(Error::Kind::data, arguments.after, "does not go on from " + arguments.before,
                "begin it as octosurf map … --resume " + arguments.before + " -o " + arguments.after);
  print_answer(json_of(changes_since(after, before.revision), before, after), arguments.json);
}

}  // namespace

void add_diff(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("diff", diff_description);
  const auto arguments = std::make_shared<DiffArguments>();
  verb->add_option("before", arguments->before, "map: name without ending, as given to map -o")->required();
  verb->add_option("after", arguments->after, "one that goes on from it")->required();
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_diff(*arguments); });
}

}  // namespace octosurf
