#include "upkeep/derive.hpp"

#include <algorithm>

namespace octosurf {
namespace {

/// Surfaces that came and went within the scan are noted, too: one may link a parent to its heirs.
void note_departures(MapState& state, const Snapshot& before) {
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

}  // namespace

std::shared_ptr<const Snapshot> derive(MapState& state, const std::set<SurfaceId>& touched) {
  ++state.revision;
  const std::shared_ptr<const Snapshot> before = state.snapshot.load();
  auto next = std::make_shared<Snapshot>(Snapshot{state.revision, before->resolution, {}});
  for (const auto& [id, known] : state.surfaces) {
    const auto at = std::lower_bound(before->surfaces.begin(), before->surfaces.end(), id,
                                     [](const SurfacePtr& s, SurfaceId wanted) { return s->id < wanted; });
    const bool published = at != before->surfaces.end() && (*at)->id == id;
    if (published && !touched.contains(id)) {
      next->surfaces.push_back(*at);
      continue;
    }
    SurfaceModel& surface = *state.surfaces.find(id);
    surface.derive(state.parameters.max_hole_size(), &state.noise);
    surface.derive_covariance(state.noise);
    if (!published) surface.born = state.revision;
    surface.revision = state.revision;
    next->surfaces.push_back(surface.publish(state.revision));
  }
  next->cylinders = state.cylinders.publish(state.revision);
  note_departures(state, *before);
  next->departures = state.departures;
  if (state.octree_shared) next->octree = state.occupancy.share();
  return next;
}

}  // namespace octosurf
