#include "io/exporters/export_formats.hpp"
#include "io/exporters/page_messages.hpp"

#include <memory>
#include <sstream>
#include <utility>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

/// As octosurf export writes .json.
std::string export_text(const PageMap& map, const Snapshot& snapshot) {
  ExportOptions options;
  options.edges = map.edges;
  if (!map.stairs.empty()) options.stairs = Stairs{map.stairs, {}};
  const ExportJob job{snapshot, options, false};
  std::ostringstream out;
  write_json(job, out);
  return std::move(out).str();
}

Json cylinders_gone(const MapChanges& changes) {
  Json ids = changes.cylinders_gone;
  for (const auto& successor : changes.cylinders_merged) ids.push_back(successor.before);
  return ids;
}

}  // namespace

std::string surfaces_message(const PageMap& map, const SurfacesMessage& how) {
  const std::shared_ptr<const Snapshot> sent =
      how.changes ? std::make_shared<const Snapshot>(changed_part(*map.snapshot, how.changes->since))
                  : map.snapshot;
  PageBlock block;
  block.json["kind"] = "surfaces";
  block.json["run"] = how.run;
  block.json["name"] = map.name;
  block.json["since"] = how.changes ? Json(how.changes->since) : Json();
  block.json["up"] = how.up.normalized();
  block.json["changes"] = how.changes ? changes_json(*how.changes) : Json();
  if (how.changes) block.json["cylinders_gone"] = cylinders_gone(*how.changes);
  block.add("map", export_text(map, *sent));
  return block.packed();
}

Json changes_json(const MapChanges& changes) {
  Json json{{"since", changes.since},     {"revision", changes.revision}, {"appeared", changes.appeared},
            {"changed", changes.changed}, {"gone", changes.gone},         {"merged", Json::array()},
            {"split", Json::array()}};
  for (const MapChanges::Successor& successor : changes.merged)
    json["merged"].push_back({{"id", successor.before}, {"into", successor.now}});
  for (const MapChanges::Successor& successor : changes.split)
    json["split"].push_back({{"id", successor.before}, {"part", successor.now}});
  return json;
}

Snapshot changed_part(const Snapshot& snapshot, std::uint64_t since) {
  Snapshot part = snapshot;
  part.surfaces = snapshot.changed_since(since);
  std::erase_if(part.cylinders, [&](const CylinderPtr& cylinder) { return cylinder->revision <= since; });
  return part;
}

}  // namespace octosurf::io
