#include "surfaces/scan_changes.hpp"

namespace octosurf {

void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from) {
  MapState& state = work.state;
  const SurfaceId gone = from.id();
  into.take_evidence(from);
  for (const Inlier& inlier : from.sorted_inliers()) work.absorb(work.window.find(inlier.key), into);
  into.parents().push_back(gone);
  state.surfaces.erase(gone, into.id());
  work.changes.merged.insert(gone);
}

void dissolve(Workspace& work, SurfaceModel& surface, Points points) {
  const SurfaceId id = surface.id();
  for (const Inlier& inlier : surface.sorted_inliers()) {
    const Workspace::Index i = work.window.find(inlier.key);
    points == Points::requeued ? work.requeue(i) : work.release(i);
  }
  work.state.surfaces.erase(id);
  work.changes.gone.insert(id);
}

bool too_small(const Workspace& work, const SurfaceModel& surface) {
  return surface.size() < static_cast<std::size_t>(work.state.parameters.min_surface_points());
}

}  // namespace octosurf
