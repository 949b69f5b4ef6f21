#include "surfaces/succession.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::surfaces {
namespace {

SurfaceId surface_at(const MapState& map, geometry::VoxelKey key) {
  const occupancy::OccupancyMap::Lookup voxel = map.occupancy.at(key);
  return voxel.point ? voxel.point->surface : 0;
}

/// By id in the rebuilt map, those that its surfaces or cylinders get in `renamed`.
template <class Store>
std::map<std::uint64_t, std::uint64_t> ids_for(const Store& after, const Store& before,
                                               const std::map<std::uint64_t, std::uint64_t>& keepers,
                                               Store& renamed) {
  std::uint64_t next = before.next_id();
  std::map<std::uint64_t, std::uint64_t> ids;
  for (const auto& [id, one] : after) {
    const auto keeper = keepers.find(id);
    if (keeper == keepers.end()) next = before.free_id(next);
    ids[id] = keeper != keepers.end() ? keeper->second : next++;
  }
  renamed.set_next_id(next);
  return ids;
}

}  // namespace

void Succession::add(geometry::VoxelKey before, const MapState& after,
                     std::optional<geometry::VoxelKey> now) {
  surfaces_.add(surface_at(before_, before), now ? surface_at(after, *now) : 0);
  cylinders_.add(before_.cylinders.owner(before), now ? after.cylinders.owner(*now) : 0);
}

Succeeded Succession::renumber(MapState& after) const {
  const std::uint64_t revision = before_.revision + 1;
  const auto keepers = surfaces_.keepers(), origins = surfaces_.origins();
  SurfaceStore surfaces(after.parameters.occupancy.resolution);
  surfaces.set_erosion_tolerance(after.parameters.surface_tolerance());
  CylinderStore cylinders;
  const auto ids = ids_for(after.surfaces, before_.surfaces, keepers, surfaces);
  const auto cylinder_ids = ids_for(after.cylinders, before_.cylinders, cylinders_.keepers(), cylinders);
  Succeeded result{keepers.size(), after.surfaces.size() - keepers.size(), {}};

  std::map<SurfaceId, std::vector<SurfaceId>> merged;  // by id in the rebuilt map
  std::vector<Removal> removals;
  std::set<SurfaceId> used;
  for (const auto& [id, now] : ids) used.insert(now);
  for (const auto& [id, surface] : before_.surfaces) {
    if (used.contains(id)) continue;
    const auto shares = surfaces_.before().find(id);
    const SurfaceId into = shares != surfaces_.before().end() ? shares->second.most() : 0;
    if (into != 0) merged[into].push_back(id);
    result.gone.push_back(id);
    removals.push_back(
        {Removal::Of::surface, id, into != 0 ? ids.at(into) : 0, surface.born, revision, surface.parents()});
  }

  const std::shared_ptr<const Snapshot> published = after.snapshot.read();
  for (const auto& [id, surface] : after.surfaces) {
    SurfaceModel::State renamed = surface.state(published.get());
    renamed.id = ids.at(id);
    const SurfaceModel* same = before_.surfaces.find(renamed.id);
    renamed.parents = same != nullptr ? same->parents() : std::vector<SurfaceId>{};
    if (const auto origin = origins.find(id); same == nullptr && origin != origins.end())
      renamed.parents.push_back(origin->second);
    for (const SurfaceId parent : merged[id])
      if (std::ranges::find(renamed.parents, parent) == renamed.parents.end())
        renamed.parents.push_back(parent);
    renamed.born = same != nullptr ? same->born : revision;
    renamed.revision = revision;
    surfaces.restore(renamed);
  }

  for (const auto& [id, cylinder] : after.cylinders) {
    CylinderModel renamed = cylinder;
    renamed.id = cylinder_ids.at(id);
    const CylinderModel* same = before_.cylinders.find(renamed.id);
    renamed.born = same != nullptr ? same->born : revision;
    renamed.revision = revision;
    renamed.published.reset();
    cylinders.restore(std::move(renamed));
  }
  for (const auto& [id, cylinder] : before_.cylinders)
    if (cylinders.find(id) == nullptr)
      removals.push_back({Removal::Of::cylinder, id, 0, cylinder.born, revision, {}});

  after.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    if (p.surface != 0) after.occupancy.assign(p, ids.at(p.surface));
  });
  for (const auto& [id, surface] : after.surfaces) after.occupancy.remove_surface(id);
  for (const auto& [id, surface] : surfaces) after.occupancy.add_surface(id);
  after.surfaces = std::move(surfaces);
  after.cylinders = std::move(cylinders);
  after.removals = before_.removals.with(removals);
  after.revision = revision;
  publish_whole(after);
  return result;
}

void publish_whole(MapState& state) {
  auto snapshot =
      std::make_shared<Snapshot>(Snapshot{state.revision, state.parameters.occupancy.resolution, {}});
  for (const auto& [id, surface] : state.surfaces)
    snapshot->surfaces.push_back(surface.publish(surface.revision));
  snapshot->cylinders = state.cylinders.publish(state.revision);
  snapshot->removals = state.removals;
  state.snapshot.store(std::move(snapshot));
}

}  // namespace octosurf::surfaces
