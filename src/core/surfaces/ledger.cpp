#include "surfaces/ledger.hpp"

#include <algorithm>

namespace octosurf::surfaces {

Ledger::Ledger(MapState& state, Changes so_far)
    : LoadedView(state, occupancy::PointWindow(state.occupancy)), changes(std::move(so_far)), state_(state) {}

std::vector<PointId> Ledger::take_unprocessed() {
  std::vector<geometry::VoxelKey> keys = std::exchange(changes.unprocessed, {});
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<PointId> points;
  for (const geometry::VoxelKey key : keys)
    if (const PointId i = window.find(key); is_pending(i)) points.push_back(i);
  return points;
}

std::vector<PointId> Ledger::pending(std::span<const PointId> points) const {
  std::vector<PointId> pending;
  std::copy_if(points.begin(), points.end(), std::back_inserter(pending),
               [&](PointId i) { return window[i].surface == 0; });
  return pending;
}

SurfaceModel& Ledger::create(const Plane& plane, const Eigen::Vector3d& origin) {
  SurfaceModel& surface = state_.surfaces.create(plane, origin);
  state_.occupancy.add_surface(surface.id());
  return surface;
}

void Ledger::drop(const occupancy::VoxelPoint& vanished) {
  if (SurfaceModel* surface = find(vanished.surface);
      surface != nullptr && state_.surfaces.remove(*surface, vanished.key, vanished.position))
    changes.shrunk.insert(vanished.surface);
}

void Ledger::dissolve(SurfaceModel& surface, SurfaceId into) {
  const SurfaceId id = surface.id();
  for (const Inlier& inlier : surface.sorted_inliers()) requeue(window.find(inlier.key));
  state_.surfaces.erase(id, into);
  state_.occupancy.remove_surface(id);
  (into == 0 ? changes.gone : changes.merged).insert(id);
}

}  // namespace octosurf::surfaces
