#include "geometry/degrees.hpp"
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

Json feet_json(const PageMap& map) {
  Json feet = Json::array();
  for (const auto& [name, its] : map.feet) {
    Json regions = Json::array();
    for (const ContactRegion& region : its) {
      const Surface* surface = map.snapshot->find(region.surface);
      if (surface == nullptr)
        throw Error(Error::Kind::data, "foot " + name,
                    "has a region on surface " + std::to_string(region.surface) + ", which the map has not",
                    "give regions of this snapshot");
      regions.push_back(region_json(*surface, region));
    }
    feet.push_back({{"name", name}, {"regions", std::move(regions)}});
  }
  return feet;
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
  if (how.suggested_up) block.json["suggested_up"] = how.suggested_up->normalized();
  block.json["changes"] = how.changes ? changes_json(*how.changes) : Json();
  if (how.changes) block.json["cylinders_gone"] = cylinders_gone(*how.changes);
  block.json["feet"] = how.feet ? feet_json(map) : Json::array();
  block.json["feet_left_out"] = !how.feet && !map.feet.empty();
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

Json region_json(const Surface& surface, const ContactRegion& region) {
  const auto ring = [&](const Ring2& vertices) {
    Json points = Json::array();
    for (const Eigen::Vector2d& uv : vertices) points.push_back(surface.to_map(uv));
    return points;
  };
  Json json{{"surface", region.surface}, {"revision", region.revision}};
  // Divided, not multiplied by the inverse: most headings that were given in degrees come back to the digit.
  json["yaw_deg"] = region.yaw_rad ? Json(*region.yaw_rad / rad_per_deg) : Json();
  json["area_m2"] = finite(region.area_m2, region.surface);
  json["refused"] = Json::array();
  for (const ContactRefusal refusal : region.refused)
    json["refused"].push_back(contact_refusal_name(refusal));
  json["polygons"] = Json::array();
  for (const Polygon& polygon : region.polygons) {
    Json holes = Json::array();
    for (const Ring2& hole : polygon.holes) holes.push_back(ring(hole));
    json["polygons"].push_back({{"outer", ring(polygon.outer)}, {"holes", holes}});
  }
  return json;
}

}  // namespace octosurf::io
