#include "upkeep/derive.hpp"

#include <algorithm>

namespace octosurf::upkeep {
namespace {

/// Surfaces that came and went within the scan are noted, too: one may link a parent to its heirs.
void note_departures(surfaces::MapState& state, const Snapshot& before) {
  std::vector<Departure> departures = state.surfaces.take_departures();
  const std::size_t surfaces = departures.size();
  for (const Departure& cylinder : state.cylinders.take_departures()) departures.push_back(cylinder);
  if (departures.empty()) return;
  for (std::size_t i = 0; i < departures.size(); ++i) {
    Departure& departure = departures[i];
    departure.revision = state.revision;
    if (!(i < surfaces ? before.find(departure.id) != nullptr
                       : before.find_cylinder(departure.id) != nullptr))
      departure.born = state.revision;
  }
  state.departures = state.departures.with(departures);
}

/// In order of id; takes the place of what it was.
void put(std::vector<SurfacePtr>& surfaces, SurfacePtr surface) {
  const auto at = std::lower_bound(surfaces.begin(), surfaces.end(), surface->id,
                                   [](const SurfacePtr& s, SurfaceId wanted) { return s->id < wanted; });
  if (at != surfaces.end() && (*at)->id == surface->id)
    *at = std::move(surface);
  else
    surfaces.insert(at, std::move(surface));
}

}  // namespace

std::shared_ptr<const Snapshot> derive(surfaces::MapState& state, const surfaces::Changes& changes,
                                       bool inliers_alone) {
  ++state.revision;
  const std::shared_ptr<const Snapshot> before = state.snapshot.load();
  auto next = std::make_shared<Snapshot>(Snapshot{state.revision, before->resolution, {}});
  next->surfaces.reserve(before->surfaces.size() + changes.born.size());
  next->surfaces = before->surfaces;
  if (!changes.gone.empty() || !changes.merged.empty())
    std::erase_if(next->surfaces, [&](const SurfacePtr& surface) {
      return changes.gone.contains(surface->id) || changes.merged.contains(surface->id);
    });
  for (const SurfaceId id : changes.touched()) {
    surfaces::SurfaceModel& surface = *state.surfaces.find(id);
    if (inliers_alone)
      surface.derive(state.parameters.max_hole_size());
    else
      surface.derive(state.parameters.max_hole_size(), &state.noise, &state.surfaces);
    surface.derive_covariance(state.noise);
    if (before->find(id) == nullptr) surface.born = state.revision;
    surface.revision = state.revision;
    put(next->surfaces, surface.publish(state.revision));
  }
  next->cylinders = state.cylinders.publish(state.revision);
  note_departures(state, *before);
  next->departures = state.departures;
  if (state.octree_shared) next->octree = state.occupancy.share();
  return next;
}

}  // namespace octosurf::upkeep
