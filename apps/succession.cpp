#include "succession.hpp"

#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

SurfaceId surface_at(const surfaces::MapState& map, geometry::VoxelKey key) {
  const occupancy::OccupancyMap::Lookup voxel = map.occupancy.at(key);
  return voxel.point ? voxel.point->surface : 0;
}

void insert_parent(std::vector<SurfaceId>& parents, SurfaceId id) {
  if (std::find(parents.begin(), parents.end(), id) == parents.end()) parents.push_back(id);
}

}  // namespace

void Succession::add(geometry::VoxelKey before, geometry::VoxelKey after) {
  surfaces_.add(surface_at(before_, before), surface_at(after_, after));
  cylinders_.add(before_.cylinders.owner(before), after_.cylinders.owner(after));
}

void Succession::add_lost(geometry::VoxelKey before) {
  surfaces_.add(surface_at(before_, before), 0);
  cylinders_.add(before_.cylinders.owner(before), 0);
}

Identities Succession::settle() const {
  Identities identities;
  identities.revision = before_.revision + 1;
  identities.next_surface = before_.surfaces.next_id();
  identities.next_cylinder = before_.cylinders.next_id();
  const std::map<SurfaceId, SurfaceId> same_surfaces = surfaces_.pairs(), same_cylinders = cylinders_.pairs();
  if (after_.surfaces.size() - same_surfaces.size() > before_.surfaces.ids_left() ||
      after_.cylinders.size() - same_cylinders.size() > before_.cylinders.ids_left())
    throw Error(Error::Kind::data, "remap", "the ids of surfaces run out", "start a new map");
  for (const auto& [id, surface] : after_.surfaces) {
    const auto same = same_surfaces.find(id);
    identities.surfaces[id] = same != same_surfaces.end() ? same->second : identities.next_surface++;
  }
  for (const auto& [id, cylinder] : after_.cylinders) {
    const auto same = same_cylinders.find(id);
    identities.cylinders[id] = same != same_cylinders.end() ? same->second : identities.next_cylinder++;
  }
  identities.kept = same_surfaces.size();
  identities.born = after_.surfaces.size() - same_surfaces.size();
  for (const auto& [id, cylinder] : after_.cylinders) {
    const CylinderId now = identities.cylinders.at(id);
    const surfaces::CylinderModel* same = before_.cylinders.find(now);
    identities.cylinders_born[now] = same != nullptr ? same->born : identities.revision;
  }
  settle_parents(identities);
  settle_removals(identities);
  return identities;
}

void Succession::settle_parents(Identities& identities) const {
  std::set<SurfaceId> living;
  for (const auto& [after, id] : identities.surfaces) {
    living.insert(id);
    const surfaces::SurfaceModel* same = before_.surfaces.find(id);
    identities.parents[id] = same != nullptr ? same->parents() : std::vector<SurfaceId>{};
    identities.surfaces_born[id] = same != nullptr ? same->born : identities.revision;
  }
  for (const auto& [id, surface] : before_.surfaces)
    if (!living.contains(id)) identities.gone.push_back(id);
  for (const auto& [before, shares] : surfaces_.before())
    for (const auto& [after, readings] : shares.with) {
      const SurfaceId id = identities.surfaces.at(after);
      const bool born = before_.surfaces.find(id) == nullptr;
      const bool merged = !living.contains(before) && 2 * readings >= shares.all;
      const bool split = born && 2 * readings >= surfaces_.after(after);
      if (merged || split) insert_parent(identities.parents[id], before);
      if (merged) identities.merged.try_emplace(before, id);
    }
}

void Succession::settle_removals(Identities& identities) const {
  std::vector<Removal> gone;
  for (const SurfaceId id : identities.gone) {
    const surfaces::SurfaceModel& surface = *before_.surfaces.find(id);
    const auto into = identities.merged.find(id);
    gone.push_back({Removal::Of::surface, id, into != identities.merged.end() ? into->second : 0,
                    surface.born, identities.revision, surface.parents()});
  }
  for (const auto& [id, cylinder] : before_.cylinders)
    if (!identities.cylinders_born.contains(id))
      gone.push_back({Removal::Of::cylinder, id, 0, cylinder.born, identities.revision, {}});
  identities.removals = before_.removals.with(gone);
}

void renumber(surfaces::MapState& state, const Identities& identities) {
  surfaces::SurfaceStore surfaces(state.parameters.occupancy.resolution);
  surfaces.set_erosion_tolerance(state.parameters.surface_tolerance());
  const std::shared_ptr<const Snapshot> published = state.snapshot.read();
  for (const auto& [id, surface] : state.surfaces) {
    surfaces::SurfaceModel::State renamed = surface.state(published.get());
    renamed.id = identities.surfaces.at(id);
    renamed.parents = identities.parents.at(renamed.id);
    renamed.born = identities.surfaces_born.at(renamed.id);
    renamed.revision = identities.revision;
    surfaces.restore(renamed);
  }
  surfaces.set_next_id(identities.next_surface);

  surfaces::CylinderStore cylinders;
  for (const auto& [id, cylinder] : state.cylinders) {
    surfaces::CylinderModel renamed = cylinder;
    renamed.id = identities.cylinders.at(id);
    renamed.born = identities.cylinders_born.at(renamed.id);
    renamed.revision = identities.revision;
    renamed.published.reset();
    cylinders.restore(std::move(renamed));
  }
  cylinders.set_next_id(identities.next_cylinder);

  state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    if (p.surface != 0) state.occupancy.assign(p, identities.surfaces.at(p.surface));
  });
  state.surfaces = std::move(surfaces);
  state.cylinders = std::move(cylinders);
  state.removals = identities.removals;
  state.revision = identities.revision;
  auto snapshot =
      std::make_shared<Snapshot>(Snapshot{state.revision, state.parameters.occupancy.resolution, {}});
  for (const auto& [id, surface] : state.surfaces)
    snapshot->surfaces.push_back(surface.publish(state.revision));
  snapshot->cylinders = state.cylinders.publish(state.revision);
  snapshot->removals = state.removals;
  state.snapshot.store(std::move(snapshot));
}

}  // namespace octosurf
