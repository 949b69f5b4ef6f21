#include "serve/served_map.hpp"

#include "info.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/page_messages.hpp"
#include "planning/rings.hpp"
#include "surface_table.hpp"
#include "up_option.hpp"

#include <algorithm>
#include <future>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>

#include <octosurf/boundary.hpp>
#include <octosurf/changes.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/plan_files.hpp>
#include <octosurf/up.hpp>

namespace octosurf {

namespace {

using Json = nlohmann::ordered_json;

/// As export_surfaces() writes .json.
std::string export_text(const Snapshot& snapshot, const ExportOptions& options) {
  std::ostringstream out;
  io::write_json({snapshot, options}, out);
  return std::move(out).str();
}

/// The page allowed to ask this server, and told to; with a `run` to follow it, too (web/src/server.js).
std::string served(std::string html, const std::string& run) {
  constexpr std::string_view policy = "default-src 'none';", head = "<meta charset=\"utf-8\">";
  html.replace(html.find(policy), policy.size(), "default-src 'none'; connect-src 'self';");
  std::string told = "\n<meta name=\"octosurf-server\" content=\"yes\">";
  if (!run.empty()) told += "\n<meta name=\"octosurf-run\" content=\"" + run + "\">";
  html.insert(html.find(head) + head.size(), told);
  return html;
}

using planning::extent_of;

Eigen::AlignedBox3d extent_of(const Surface& surface) {
  Eigen::AlignedBox3d extent;
  for (const Polygon& polygon : surface.polygons)
    for (const Eigen::Vector2d& corner : polygon.outer) extent.extend(surface.to_map(corner));
  return extent;
}

using RegionsOfFoot = decltype(PageMap::feet)::value_type;

RegionsOfFoot page_foot(const planning::AskedMap& map, const std::string& foot, bool edges_alone) {
  planning::ContactQuestion question;
  question.foot = planning::foot_of(foot);
  if (question.foot->outline.empty()) question.robot = Quadruped{};
  if (edges_alone) question.clearance_m = question.obstacle_margin_m = 0;
  const GroundView ground = map.ground(planning::rules_of(question, map.up, map.octree.resolution()));
  RegionsOfFoot result{foot + (edges_alone ? " m, by slope and edges alone" : " m, with all limits of plan"),
                       {}};
  for (const SurfacePtr& surface : map.snapshot->surfaces) {
    // For a wall other limits are not evaluated, to save time.
    if (slope_rad(*surface, map.up) > ground.rules().limits.max_slope_rad)
      result.second.push_back({surface->id, surface->revision, {}, {}, 0, {ContactRefusal::slope}});
    else
      result.second.push_back(ground.region(surface->id, std::nullopt));
  }
  return result;
}

/// Contact regions on all surfaces for feet as of --foot, for any heading, with the limits of `plan` for such
/// a foot: a biped's for a sole, a quadruped's for a ball. Throws Error(usage) for an invalid foot. Seconds
/// to minutes: obstacles on a floor are cut out of it voxel by voxel. Without feet: those of `plan`, limited
/// by slope and edges alone, in some ms.
std::vector<RegionsOfFoot> page_feet(const planning::AskedMap& map, const std::vector<std::string>& feet) {
  const bool usual = feet.empty();
  std::vector<std::future<RegionsOfFoot>> asking;  // in threads, if they are available
  for (const std::string& foot : usual ? std::vector<std::string>{"0.22x0.11", "0.03"} : feet)
    asking.push_back(std::async([&map, foot, usual] { return page_foot(map, foot, usual); }));
  std::vector<RegionsOfFoot> result;
  for (std::future<RegionsOfFoot>& foot : asking) result.push_back(foot.get());
  return result;
}

/// Throws Error(data): there is no such surface, or what became of it.
[[noreturn]] void refuse_missing(const planning::AskedMap& map, SurfaceId id) {
  const std::string name = "surface " + std::to_string(id);
  std::optional<std::uint64_t> removed;
  map.snapshot->removals.for_each_since(0, [&](const Removal& one) {
    if (one.of != Removal::Of::surface || one.id != id) return;
    if (one.born < one.revision) removed = one.revision;  // else no reader saw it
  });
  if (!removed)
    throw Error(Error::Kind::data, map.name, "has no " + name, "/api/surfaces lists those that it has");
  std::string into;
  for (const MapChanges::Successor& one : changes_since(*map.snapshot, *removed - 1).merged)
    if (one.before == id) into += (into.empty() ? "" : ", ") + std::to_string(one.now);
  const std::string when = " in revision " + std::to_string(*removed);
  if (into.empty())
    throw Error(Error::Kind::data, map.name, name + " went" + when, "no other surface goes on from it");
  throw Error(Error::Kind::data, map.name, name + " was merged" + when + "; it goes on in " + into,
              "ask for id " + into);
}

}  // namespace

std::map<SurfaceId, std::vector<PolygonEdges>> edges_in(const Snapshot& snapshot, const Map& map) {
  std::map<SurfaceId, std::vector<PolygonEdges>> edges;
  for (const SurfacePtr& surface : snapshot.surfaces) edges[surface->id] = label_edges(map, *surface);
  return edges;
}

std::shared_ptr<const Snapshot> ShownSurfaces::of(const GroundView& ground) {
  const auto shown = std::make_shared<Snapshot>(*ground.solid());
  const std::lock_guard lock(mutex_);
  const bool latest = shown->revision >= latest_;
  if (latest) {
    latest_ = shown->revision;
    std::erase_if(outlines_, [&](const auto& one) { return shown->find(one.first) == nullptr; });
  }
  for (SurfacePtr& surface : shown->surfaces) {
    Outline found{surface};
    if (const auto known = outlines_.find(surface->id); known != outlines_.end())
      found.revision =
          planning::same_outline(*known->second.surface, *surface) ? known->second.revision : shown->revision;
    if (latest) outlines_[surface->id] = found;
    if (surface->revision >= found.revision) continue;
    auto changed = std::make_shared<Surface>(*surface);
    changed->revision = std::min(found.revision, shown->revision);
    surface = std::move(changed);
  }
  return shown;
}

ServedMap::ServedMap(LoadedMap map, std::string name, const std::string& up, double max_page_mb)
    : asked{std::move(name), map.map.snapshot(), map.map.octree(), up_in_force(map.map, up).direction,
            [this](const Surface& surface) { return label_edges(map_->map, surface); }},
      max_page_mb_(max_page_mb),
      up_(up),
      map_(std::move(map)) {}

ServedMap::ServedMap(std::shared_ptr<const Snapshot> snapshot, std::string name, const Eigen::Vector3d& up,
                     Run of, const ServedMap* previous)
    : asked{std::move(name),
            snapshot,
            snapshot->octree,
            up,
            [](const Surface&) -> std::vector<PolygonEdges> {
              throw Error(Error::Kind::usage, "frontier_margin_m", "is not known while the map grows",
                          "leave it away until it is saved");
            },
            previous != nullptr ? &previous->asked : nullptr},
      run(std::move(of)),
      max_page_mb_(PageOptions{}.max_mb) {}

template <class Make>
ServedMap::Text ServedMap::text(const std::string& key, const Make& make) const {
  return texts_.get(key, [&] { return std::make_shared<const std::string>(make()); });
}

std::shared_ptr<const Snapshot> ServedMap::shown() const {
  return shown_.get(0, [this] {
    const GroundView ground = asked.bare_ground();
    return map_ ? ground.solid() : run.shown->of(ground);
  });
}

PageMap ServedMap::page_map() const {
  PageMap map{asked.name, shown(), asked.octree};
  map.stairs = asked.bare_ground().stairs().stairs;
  return map;
}

Page ServedMap::page_with(const std::vector<std::string>& feet) const {
  PageOptions options;
  options.up = asked.up;
  options.max_mb = max_page_mb_;
  PageMap map = page_map();
  // Of a map that grows they would be outdated at once: its page requests them.
  if (map_) {
    if (const auto up = suggested_up(map_->map, up_)) options.suggested_up = up->direction;
    // For a hall edges and feet take seconds each: in parallel, if a thread is available.
    auto edges = std::async([&] { return edges_in(*map.snapshot, map_->map); });
    if (feet != std::vector<std::string>{"none"}) map.feet = page_feet(asked, feet);
    map.edges = edges.get();
  }
  return make_page(map, options);
}

ServedMap::Text ServedMap::page() const {
  return text("page", [this] { return served(page_with({}).html, run.name); });
}

ServedMap::Text ServedMap::info() const {
  return text("info", [this] {
    if (map_) return info_json(*map_, up_);
    const Snapshot& snapshot = *asked.snapshot;
    return Json{{"resolution", snapshot.resolution},
                {"revision", snapshot.revision},
                {"surfaces", snapshot.surfaces.size()},
                {"area_m2", total_area(snapshot)},
                {"cylinders", snapshot.cylinders.size()}}
               .dump() +
           "\n";
  });
}

const ServedMap::Export& ServedMap::exported() const {
  return exported_.get(0, [this]() -> Export {
    // What is clear of obstacles takes seconds, and a growing map has changed by then.
    if (!map_) return {shown(), {}};
    const GroundView ground = asked.bare_ground();
    Export all{ground.supported(), {}};
    all.options.gaps = ground.gaps();
    all.options.edges = edges_in(*all.snapshot, map_->map);
    return all;
  });
}

ServedMap::Text ServedMap::surfaces() const {
  return text("surfaces", [this] {
    ExportOptions options = exported().options;
    options.stairs = asked.bare_ground().stairs();
    return export_text(*exported().snapshot, options);
  });
}

ServedMap::Text ServedMap::voxels() const {
  return text("voxels", [this] {
    return io::voxels_message({asked.name, asked.snapshot, asked.octree}, max_page_mb_ * 1e6).packed;
  });
}

ServedMap::Text ServedMap::changes_event(std::optional<std::uint64_t> since) const {
  const std::lock_guard lock(making_);
  if (event_ && event_since_ == since) return event_;
  const PageMap map = page_map();
  io::SurfacesMessage how;
  how.up = asked.up;
  if (since) how.changes = changes_since(*map.snapshot, *since);
  how.run = run.name;
  event_ = std::make_shared<const std::string>(
      "event: changes\ndata: " + io::base64(io::surfaces_message(map, how)) + "\n\n");
  event_since_ = since;
  return event_;
}

std::string ServedMap::surface_json(SurfaceId id) const {
  const auto& [snapshot, all] = exported();
  const auto at = std::find_if(snapshot->surfaces.begin(), snapshot->surfaces.end(),
                               [id](const SurfacePtr& surface) { return surface->id == id; });
  if (at == snapshot->surfaces.end()) refuse_missing(asked, id);
  Snapshot alone{snapshot->revision, snapshot->resolution, {*at}};
  ExportOptions options;
  if (const auto gaps = all.gaps.find(id); gaps != all.gaps.end()) options.gaps.insert(*gaps);
  if (const auto edges = all.edges.find(id); edges != all.edges.end()) options.edges.insert(*edges);
  return Json::parse(export_text(alone, options))["surfaces"][0].dump();
}

std::string ServedMap::plan_json(const PlanQuery& query) const {
  const Robot robot = robot_of(query, asked.up);
  Json key{name_of(robot), query.unknown_is_free};
  if (query.foot) {
    key.push_back(query.foot->radius);
    for (const Eigen::Vector2d& corner : query.foot->outline) key.push_back(corner);
  }
  for (const auto& [limit, value] : query.limits) key.push_back({limit->name, value});
  const std::lock_guard lock(planning_);
  if (planned_for_ != key.dump()) {
    planner_ = std::make_unique<FootstepPlanner>(planner_on(asked, robot));
    planned_for_ = key.dump();
  }
  return to_json(planner_->plan(query.from, query.to, query.budget), robot);
}

std::string ServedMap::changes_json(std::uint64_t since,
                                    const std::optional<Eigen::AlignedBox3d>& box) const {
  Snapshot now = io::changed_part(*shown(), since);
  MapChanges changes = changes_since(*shown(), since);
  std::vector<SurfaceId> outside;
  if (box) {
    const auto elsewhere = [&](const auto& one) { return !box->intersects(extent_of(*one)); };
    std::erase_if(now.cylinders, elsewhere);
    std::erase_if(now.surfaces, elsewhere);
    const auto leave_out = [&](SurfaceId id) { return now.find(id) == nullptr; };
    std::erase_if(changes.appeared, leave_out);
    std::copy_if(changes.changed.begin(), changes.changed.end(), std::back_inserter(outside), leave_out);
    std::erase_if(changes.changed, leave_out);
  }
  Json told = io::changes_json(changes);
  if (box) told["outside"] = outside;
  std::string text = told.dump();
  text.back() = ',';
  std::string text_now = export_text(now, {});
  text_now.pop_back();  // the end of its last line
  return text + "\"now\":" + text_now + "}";
}

}  // namespace octosurf
