#include "surfaces/ledger.hpp"

namespace octosurf::surfaces {

Ledger::Ledger(MapState& state, occupancy::PointWindow points)
    : MapView{state.parameters, state.occupancy.grid(), state.surfaces, state.cylinders, state.noise,
              points_,          normals_of_points_},
      state_(state),
      points_(std::move(points)),
      normals_of_points_(points_, state.parameters, state.noise, state.surfaces) {}

void Ledger::drop(const occupancy::VoxelPoint& vanished) {
  if (SurfaceModel* surface = find(vanished.surface);
      surface != nullptr && state_.surfaces.remove(*surface, vanished.key, vanished.position))
    changes.shrunk.insert(vanished.surface);
}

void Ledger::merge(SurfaceModel& into, SurfaceModel& from) {
  const SurfaceId gone = from.id();
  into.take_evidence(from);
  for (const Inlier& inlier : from.sorted_inliers()) absorb(window.find(inlier.key), into);
  into.parents().push_back(gone);
  state_.surfaces.erase(gone, into.id());
  changes.merged.insert(gone);
}

void Ledger::dissolve(SurfaceModel& surface, Points points, SurfaceId into) {
  const SurfaceId id = surface.id();
  for (const Inlier& inlier : surface.sorted_inliers()) {
    const Index i = window.find(inlier.key);
    points == Points::requeued ? requeue(i) : release(i);
  }
  state_.surfaces.erase(id, into);
  (into == 0 ? changes.gone : changes.merged).insert(id);
}

}  // namespace octosurf::surfaces
