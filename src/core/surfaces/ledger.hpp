#pragma once

#include "surfaces/map_view.hpp"

#include <set>
#include <utility>
#include <vector>

namespace octosurf::surfaces {

/// Changes of surfaces by a scan so far; sets, so that results are in order of id.
struct Changes {
  std::set<SurfaceId> born, grown, shrunk, merged, gone;
  std::set<SurfaceId> refitted;              ///< plane changed, with or without points
  std::vector<geometry::VoxelKey> requeued;  ///< pending points to consider in the next detection

  /// Every surface whose inliers or plane changed.
  std::set<SurfaceId> touched() const {
    std::set<SurfaceId> all = born;
    all.insert(grown.begin(), grown.end());
    all.insert(shrunk.begin(), shrunk.end());
    all.insert(refitted.begin(), refitted.end());
    for (const SurfaceId id : gone) all.erase(id);
    for (const SurfaceId id : merged) all.erase(id);
    return all;
  }
};

/// The only way for stages to change the surface of a point. Keeps octree, window, surfaces and the record of
/// changes consistent. Rolling back is the Transaction's task. Valid until the octree's next scan.
class Ledger : public MapView {
 public:
  explicit Ledger(MapState& state);
  Ledger(const Ledger&) = delete;  // the view refers to its members
  Ledger& operator=(const Ledger&) = delete;

  Changes changes;

  SurfaceModel* find(SurfaceId id) { return state_.surfaces.find(id); }
  /// Creates a surface without points.
  SurfaceModel& create(const Plane& plane, const Eigen::Vector3d& origin) {
    return state_.surfaces.create(plane, origin);
  }
  CylinderStore& cylinder_store() { return state_.cylinders; }

  /// Assigns a pending point to the surface.
  void give(Index i, SurfaceModel& surface) {
    state_.cylinders.release(window[i].key);
    add(i, surface);
  }
  /// Moves a point from its surface to another.
  void reassign(Index i, SurfaceModel& to) {
    changes.shrunk.insert(window[i].surface);
    remove(i, window[i].position);
    add(i, to);
  }
  /// The surface keeps a point whose position changed from `before`.
  void move(Index i, const Eigen::Vector3f& before) {
    SurfaceModel& surface = remove(i, before);
    add(i, surface);
  }
  /// Removes a point from its surface: it becomes pending, to be considered in the next detection. `before`:
  /// its position in the surface, if different.
  void requeue(Index i) { requeue(i, window[i].position); }
  void requeue(Index i, const Eigen::Vector3f& before) {
    release(i, before);
    changes.requeued.push_back(window[i].key);
  }
  /// Removes a point from its surface that is no longer in the octree.
  void drop(const occupancy::VoxelPoint& vanished);

  /// Removes the surface; its points become pending, to be considered in the next detection. `into`: the
  /// surface that absorbed it, if any.
  void dissolve(SurfaceModel& surface, SurfaceId into = 0);

  /// Whether fewer than n inliers are left.
  bool too_small(const SurfaceModel& surface) const {
    return surface.size() < static_cast<std::size_t>(parameters.min_surface_points());
  }

 private:
  void add(Index i, SurfaceModel& surface) {
    const occupancy::VoxelPoint& p = window[i];
    state_.surfaces.add(surface, {p.key, p.range_class, p.position});
    points_.assign(i, surface.id());
    changes.grown.insert(surface.id());
  }
  SurfaceModel& remove(Index i, const Eigen::Vector3f& position) {
    SurfaceModel& surface = *find(window[i].surface);
    state_.surfaces.remove(surface, window[i].key, position);
    return surface;
  }
  void release(Index i, const Eigen::Vector3f& before) {
    changes.shrunk.insert(remove(i, before).id());
    points_.assign(i, 0);
  }

  MapState& state_;
  occupancy::PointWindow points_;
  NormalField normals_of_points_;
};

}  // namespace octosurf::surfaces
