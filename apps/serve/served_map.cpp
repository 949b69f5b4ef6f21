#include "serve/served_map.hpp"

#include "io/exporters/page_messages.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <string_view>

#include <octosurf/changes.hpp>

namespace octosurf {
namespace {

/// The page that may read from this server, with the run that it follows (web/src/follow.js).
std::string following(std::string html, const std::string& run) {
  constexpr std::string_view policy = "default-src 'none';", head = "<meta charset=\"utf-8\">";
  html.replace(html.find(policy), policy.size(), "default-src 'none'; connect-src 'self';");
  html.insert(html.find(head) + head.size(), "\n<meta name=\"octosurf-run\" content=\"" + run + "\">");
  return html;
}

}  // namespace

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

ServedMap::ServedMap(planning::AskedMap map, double max_page_mb, ServedRun of, const ServedMap* previous)
    : asked(std::move(map)),
      run(std::move(of)),
      ground_(previous != nullptr ? previous->ground_.next(asked.snapshot, asked.octree)
                                  : asked.bare_ground()),
      max_page_mb_(max_page_mb) {}

std::shared_ptr<const Snapshot> ServedMap::shown() const {
  return shown_.get(0, [this] { return run.name.empty() ? ground_.solid() : run.shown->of(ground_); });
}

PageMap ServedMap::page_map() const {
  PageMap map{asked.name, shown(), asked.octree};
  map.stairs = ground_.stairs().stairs;
  return map;
}

std::string ServedMap::page() const {
  PageOptions options;
  options.up = asked.up;
  options.max_mb = max_page_mb_;
  return make_page(page_map(), options);
}

ServedMap::Text ServedMap::page_html() const {
  return texts_.get("page", [this] {
    return std::make_shared<const std::string>(run.name.empty() ? page() : following(page(), run.name));
  });
}

ServedMap::Text ServedMap::voxels() const {
  return texts_.get("voxels", [this] {
    return std::make_shared<const std::string>(
        io::voxels_message({asked.name, asked.snapshot, asked.octree}, max_page_mb_ * 1e6));
  });
}

std::string ServedMap::changes_json(std::optional<std::uint64_t> since, const std::string& of_run) const {
  std::optional<MapChanges> changes;  // none: the page starts anew
  if (since && (of_run.empty() || of_run == run.name) && *since <= asked.snapshot->revision &&
      *since >= asked.snapshot->removals.complete_since())
    changes = changes_since(*asked.snapshot, *since);
  return io::surfaces_message(page_map(), asked.up, run.name, changes).document();
}

}  // namespace octosurf
