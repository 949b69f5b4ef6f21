#pragma once

#include "surfaces/cells.hpp"
#include "surfaces/proposal.hpp"

#include <set>
#include <span>
#include <vector>

namespace octosurf::surfaces {

/// Changes of surfaces by a scan so far; sets, so that results are in order of id.
struct Changes {
  std::set<SurfaceId> born, grown, shrunk, merged, gone;
  std::set<SurfaceId> refitted;                 ///< plane changed, with or without points
  std::vector<geometry::VoxelKey> unprocessed;  ///< appeared or became pending since take_unprocessed()

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

/// The only way to change the surface of a point: stages that decide return proposals for apply(); retraction
/// and adoption move points one by one. Keeps octree, window, surfaces and the record of changes consistent.
/// Rolling back is mapper::MapChange's task. Valid until the octree's next scan.
class Ledger : public LoadedView {
 public:
  /// `so_far`: the changes by the transaction's earlier scans.
  explicit Ledger(MapState& state, Changes so_far = {});

  Changes changes;

  /// The unprocessed points that are pending, each once, in key order.
  std::vector<PointId> take_unprocessed();
  /// Of these points, those that are pending.
  std::vector<PointId> pending(std::span<const PointId> points) const;
  PendingQueue& queue() { return state_.queue; }
  std::uint64_t revision() const { return state_.revision; }

  void apply(std::span<const Assignment> assignments);
  /// Assigns the points of a proposal to its planes. A surface keeps its id in the plane with most of its
  /// readings; of several in one plane the one with most readings there stays, and the others merge into it.
  /// Other planes get new ids, and the surface that had most of their readings as parent. Evidence of later
  /// scans is kept where nine tenths of a surface's readings are. Points that lose their surface are
  /// unprocessed. Planes of surfaces whose points changed become the proposal's. `refit`: to all readings of
  /// its surface. Surfaces entirely among the points are marked as checked. Cost: the proposal, and the
  /// reassigned points.
  void apply(const Proposal& proposal, bool refit = true);

  SurfaceModel* find(SurfaceId id) { return state_.surfaces.find(id); }
  /// Creates a surface without points.
  SurfaceModel& create(const Plane& plane, const Eigen::Vector3d& origin);
  CylinderStore& cylinder_store() { return state_.cylinders; }

  /// Sets the surface's plane to the estimate from its readings.
  void fit(SurfaceModel& surface);

  /// Assigns a pending point to the surface.
  void give(PointId i, SurfaceModel& surface) {
    state_.cylinders.release(window[i].key);
    add(i, surface);
  }
  /// Moves a point from its surface to another.
  void reassign(PointId i, SurfaceModel& to) {
    changes.shrunk.insert(window[i].surface);
    remove(i, window[i].position);
    add(i, to);
  }
  /// The surface keeps a point whose position changed from `before`.
  void move(PointId i, const Eigen::Vector3f& before) {
    SurfaceModel& surface = remove(i, before);
    add(i, surface);
  }
  /// Removes a point from its surface: it becomes pending, and is unprocessed. `before`:
  /// its position in the surface, if different.
  void requeue(PointId i) { requeue(i, window[i].position); }
  void requeue(PointId i, const Eigen::Vector3f& before) {
    release(i, before);
    changes.unprocessed.push_back(window[i].key);
  }
  /// Removes a point from its surface that is no longer in the octree.
  void drop(const occupancy::VoxelPoint& vanished);

  /// Removes the surface; its points become pending, and are unprocessed. `into`: the surface that absorbed
  /// it, if any.
  void dissolve(SurfaceModel& surface, SurfaceId into = 0);

  /// Whether fewer than n inliers are left.
  bool too_small(const SurfaceModel& surface) const {
    return surface.size() < static_cast<std::size_t>(parameters.min_surface_points());
  }

 private:
  class Writer;
  void add(PointId i, SurfaceModel& surface) {
    const occupancy::VoxelPoint& p = window[i];
    state_.surfaces.add(surface, {p.key, p.range_class, p.position});
    assign(i, surface.id());
    changes.grown.insert(surface.id());
  }
  SurfaceModel& remove(PointId i, const Eigen::Vector3f& position) {
    SurfaceModel& surface = *find(window[i].surface);
    state_.surfaces.remove(surface, window[i].key, position);
    return surface;
  }
  void release(PointId i, const Eigen::Vector3f& before) {
    changes.shrunk.insert(remove(i, before).id());
    assign(i, 0);
  }

  MapState& state_;
};

}  // namespace octosurf::surfaces
