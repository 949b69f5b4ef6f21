#pragma once

#include "surfaces/map_view.hpp"

#include <set>
#include <utility>
#include <vector>

namespace octosurf::surfaces {

/// What a scan did to the surfaces so far; sets, so that results come in order of id.
struct Changes {
  std::set<SurfaceId> born, grown, shrunk, merged, gone;
  std::set<SurfaceId> refitted;              ///< whose plane is another, points or not
  std::vector<geometry::VoxelKey> requeued;  ///< pending points that the next detection looks at again

  /// Every surface whose inliers or plane are no longer what they were.
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

/// Through which alone stages change whose a point is. It keeps octree, window, surfaces and the record of
/// what has changed in step. Taking all of it back is the Transaction's work. Valid until the octree's next
/// scan.
class Ledger : public MapView {
 public:
  explicit Ledger(MapState& state);
  Ledger(const Ledger&) = delete;  // the view refers to its members
  Ledger& operator=(const Ledger&) = delete;

  Changes changes;

  SurfaceModel* find(SurfaceId id) { return state_.surfaces.find(id); }
  /// A surface without points, as yet.
  SurfaceModel& create(const Plane& plane, const Eigen::Vector3d& origin) {
    return state_.surfaces.create(plane, origin);
  }
  CylinderStore& cylinder_store() { return state_.cylinders; }

  /// Makes a pending point the surface's.
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
  /// The surface keeps a point that was at `before`.
  void move(Index i, const Eigen::Vector3f& before) {
    SurfaceModel& surface = remove(i, before);
    add(i, surface);
  }
  /// Takes a point from its surface: it is pending, and the next detection looks at it. `before`: where the
  /// surface has it, if that is elsewhere.
  void requeue(Index i) { requeue(i, window[i].position); }
  void requeue(Index i, const Eigen::Vector3f& before) {
    release(i, before);
    changes.requeued.push_back(window[i].key);
  }
  /// Takes a point from its surface that is no longer in the octree.
  void drop(const occupancy::VoxelPoint& vanished);

  /// Its points are pending again, and the next detection looks at them; it is gone. `into`: who has taken it
  /// in, if somebody has.
  void dissolve(SurfaceModel& surface, SurfaceId into = 0);

  /// Fewer than n inliers are left.
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
