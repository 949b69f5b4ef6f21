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

Json successors_json(const std::vector<MapChanges::Successor>& all, const char* now) {
  Json list = Json::array();
  for (const MapChanges::Successor& one : all) list.push_back({{"id", one.before}, {now, one.now}});
  return list;
}

}  // namespace

PageBlock surfaces_message(const PageMap& map, const Eigen::Vector3d& up, const std::string& run,
                           const std::optional<MapChanges>& since) {
  Snapshot sent = *map.snapshot;
  MapChanges changes = since.value_or(MapChanges{});
  if (since) {
    sent.surfaces = sent.changed_since(since->since);
    std::erase_if(sent.cylinders,
                  [&](const CylinderPtr& cylinder) { return cylinder->revision <= since->since; });
  }
  for (const auto& successor : changes.cylinders_merged) changes.cylinders_gone.push_back(successor.before);
  PageBlock block;
  block.json = {{"kind", "surfaces"},
                {"run", run},
                {"name", map.name},
                {"up", up.normalized()},
                {"since", since ? Json(since->since) : Json()},
                {"revision", sent.revision},
                {"appeared", changes.appeared},
                {"changed", changes.changed},
                {"gone", changes.gone},
                {"merged", successors_json(changes.merged, "into")},
                {"split", successors_json(changes.split, "part")},
                {"cylinders_gone", changes.cylinders_gone}};
  block.add("now", export_text(map, sent));
  return block;
}

}  // namespace octosurf::io
