#include "surfaces/ledger.hpp"

namespace octosurf::surfaces {

Ledger::Ledger(MapState& state)
    : MapView{state.parameters, state.occupancy.grid(), state.surfaces, state.cylinders, state.noise,
              points_,          normals_of_points_},
      state_(state),
      points_(state.occupancy),
      normals_of_points_(points_, state.parameters, state.noise, state.surfaces) {}

void Ledger::drop(const occupancy::VoxelPoint& vanished) {
  if (SurfaceModel* surface = find(vanished.surface);
      surface != nullptr && state_.surfaces.remove(*surface, vanished.key, vanished.position))
    changes.shrunk.insert(vanished.surface);
}

void Ledger::dissolve(SurfaceModel& surface, SurfaceId into) {
  const SurfaceId id = surface.id();
  for (const Inlier& inlier : surface.sorted_inliers()) requeue(window.find(inlier.key));
  state_.surfaces.erase(id, into);
  (into == 0 ? changes.gone : changes.merged).insert(id);
}

}  // namespace octosurf::surfaces
