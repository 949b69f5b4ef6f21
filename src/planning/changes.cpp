#include "geometry/breadth_first.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <octosurf/changes.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

/// Successions from earlier objects to present ones, for surfaces or for cylinders.
class Lineage {
 public:
  using Id = std::uint64_t;

  void add_living(Id id) { living_.insert(id); }
  void pass_on(Id from, Id to) { successors_[from].insert(to); }

  /// Present objects with a part of `id`, except `id` itself.
  std::set<Id> living_successors(Id id) const {
    std::set<Id> seen{id}, found;
    std::vector<Id> reached{id};
    geometry::breadth_first(reached, [&](Id at) {
      const auto successors = successors_.find(at);
      if (successors == successors_.end()) return;
      for (const Id successor : successors->second) {
        if (!seen.insert(successor).second) continue;
        if (living_.contains(successor)) found.insert(successor);
        reached.push_back(successor);
      }
    });
    return found;
  }
  bool passed_anything_on(Id id) const { return successors_.contains(id); }

 private:
  std::set<Id> living_;
  std::map<Id, std::set<Id>> successors_;
};

struct Past {
  Lineage surfaces, cylinders;
  std::vector<SurfaceId> surfaces_gone;  // that existed at the earlier revision
  std::vector<CylinderId> cylinders_gone;
};

/// The first parents of a surface born since are those it was split from. Later ones were merged into it,
/// which their removals also record; duplicates do no harm.
void note_parents(std::uint64_t born, SurfaceId id, const std::vector<SurfaceId>& parents,
                  std::uint64_t since, Lineage& lineage) {
  if (born <= since) return;
  for (const SurfaceId parent : parents) lineage.pass_on(parent, id);
}

Past past_of(const Snapshot& snapshot, std::uint64_t since) {
  Past past;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    past.surfaces.add_living(surface->id);
    note_parents(surface->born, surface->id, surface->parents, since, past.surfaces);
  }
  for (const CylinderPtr& cylinder : snapshot.cylinders) past.cylinders.add_living(cylinder->id);
  snapshot.removals.for_each_since(since, [&](const Removal& removal) {
    const bool surface = removal.of == Removal::Of::surface;
    Lineage& lineage = surface ? past.surfaces : past.cylinders;
    if (removal.into != 0) lineage.pass_on(removal.id, removal.into);
    note_parents(removal.born, removal.id, removal.parents, since, lineage);
    if (removal.born <= since) (surface ? past.surfaces_gone : past.cylinders_gone).push_back(removal.id);
  });
  std::sort(past.surfaces_gone.begin(), past.surfaces_gone.end());
  std::sort(past.cylinders_gone.begin(), past.cylinders_gone.end());
  return past;
}

}  // namespace

MapChanges changes_since(const Snapshot& snapshot, std::uint64_t since) {
  if (since != 0 && since < snapshot.removals.complete_since())
    throw Error(
        Error::Kind::data, "changes_since",
        "removals before revision " + std::to_string(snapshot.removals.complete_since()) + " are not kept",
        "read the snapshot anew");
  if (since > snapshot.revision)
    throw Error(Error::Kind::usage, "changes_since",
                "the map is at revision " + std::to_string(snapshot.revision) + ", not yet at " +
                    std::to_string(since),
                "give the revision of an earlier snapshot of the same map");
  const Past past = past_of(snapshot, since);
  MapChanges changes;
  changes.since = since;
  changes.revision = snapshot.revision;
  const auto note_living = [since](const auto& all, auto& appeared, auto& changed) {
    for (const auto& one : all)
      if (one->born > since)
        appeared.push_back(one->id);
      else if (one->revision > since)
        changed.push_back(one->id);
  };
  const auto note_gone = [](const Lineage& lineage, const auto& ids, auto& gone, auto& merged) {
    for (const auto id : ids) {
      const auto successors = lineage.living_successors(id);
      if (successors.empty()) gone.push_back(id);
      for (const auto successor : successors) merged.push_back({id, successor});
    }
  };
  note_living(snapshot.surfaces, changes.appeared, changes.changed);
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (surface->born > since || !past.surfaces.passed_anything_on(surface->id)) continue;
    for (const SurfaceId successor : past.surfaces.living_successors(surface->id))
      changes.split.push_back({surface->id, successor});
  }
  note_gone(past.surfaces, past.surfaces_gone, changes.gone, changes.merged);
  note_living(snapshot.cylinders, changes.cylinders_appeared, changes.cylinders_changed);
  note_gone(past.cylinders, past.cylinders_gone, changes.cylinders_gone, changes.cylinders_merged);
  return changes;
}

}  // namespace octosurf
