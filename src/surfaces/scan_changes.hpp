#pragma once

#include "surfaces/map_state.hpp"
#include "surfaces/normal_field.hpp"
#include "surfaces/refusal.hpp"

#include <map>
#include <set>
#include <utility>

namespace octosurf {

/// What a scan did to the surfaces so far; sets, so that results come in order of id.
struct Changes {
  std::set<SurfaceId> born, grown, shrunk, merged, gone;
  std::map<SurfaceId, Refusal> unsound;  ///< of those of the gone that refit() dissolved

  /// Every surface whose inliers are no longer what they were.
  std::set<SurfaceId> touched() const {
    std::set<SurfaceId> all = born;
    all.insert(grown.begin(), grown.end());
    all.insert(shrunk.begin(), shrunk.end());
    for (const SurfaceId id : gone) all.erase(id);
    for (const SurfaceId id : merged) all.erase(id);
    return all;
  }
};

/// One scan's working set, handed from stage to stage. Whatever changes the owner of a point goes through
/// give(), reassign(), release() and requeue(), which keep octree, surfaces and records in step; points of
/// vanished voxels alone leave their surfaces without (retract() in src/upkeep).
class Workspace {
 public:
  using Index = PointWindow::Index;

  explicit Workspace(MapState& map_state) : Workspace(map_state, PointWindow(map_state.occupancy)) {}
  /// On another octree's points than the state's own.
  Workspace(MapState& map_state, PointWindow points)
      : state(map_state),
        window(std::move(points)),
        normals(window, map_state.parameters, map_state.noise, map_state.surfaces) {}
  Workspace(const Workspace&) = delete;  // `normals` refers to `window`
  Workspace& operator=(const Workspace&) = delete;

  MapState& state;
  PointWindow window;
  NormalField normals;
  Changes changes;
  std::vector<VoxelKey> requeued;  ///< pending points that the next detection looks at again

  /// What plane detection looked at and may not have taken: for cylinders.
  struct LeftOver {
    std::vector<std::vector<Index>> regions;  ///< smooth ones, key order each
    std::vector<Index> points;                ///< that waited for detection
  } left_over;

  /// Makes a pending point the surface's.
  void give(Index i, SurfaceModel& surface) {
    state.cylinders.release(window[i].key);
    add(i, surface);
  }
  /// Moves a point from its surface to another.
  void reassign(Index i, SurfaceModel& to) {
    changes.shrunk.insert(window[i].surface);
    absorb(i, to);
  }
  /// The same for a surface that is about to end: it is not recorded as shrunk.
  void absorb(Index i, SurfaceModel& to) {
    remove(i, window[i].position);
    add(i, to);
  }
  /// The surface keeps a point that was at `before`.
  void move(Index i, const Eigen::Vector3f& before) {
    SurfaceModel& surface = remove(i, before);
    add(i, surface);
  }
  /// Takes a point from its surface: it is pending, and no detection looks at it before something near it
  /// changes.
  void release(Index i) { release(i, window[i].position); }
  /// Takes a point from its surface: it is pending, and the next detection looks at it. `before`: where the
  /// surface has it, if that is elsewhere.
  void requeue(Index i) { requeue(i, window[i].position); }
  void requeue(Index i, const Eigen::Vector3f& before) {
    release(i, before);
    requeued.push_back(window[i].key);
  }

 private:
  void add(Index i, SurfaceModel& surface) {
    const VoxelPoint& p = window[i];
    state.surfaces.add(surface, {p.key, p.range_class, p.position});
    window.assign(i, surface.id());
    changes.grown.insert(surface.id());
  }
  SurfaceModel& remove(Index i, const Eigen::Vector3f& position) {
    SurfaceModel& surface = *state.surfaces.find(window[i].surface);
    state.surfaces.remove(surface, window[i].key, position);
    return surface;
  }
  void release(Index i, const Eigen::Vector3f& before) {
    changes.shrunk.insert(remove(i, before).id());
    window.assign(i, 0);
  }
};

/// Merges `from` into `into`: inliers, moments, lineage. `from` ceases to exist.
void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from);

/// What becomes of the points of a surface that ends. `released`: detection would only find the same plane
/// in them again.
enum class Points { requeued, released };

/// Its points are pending again, and it is gone.
void dissolve(Workspace& work, SurfaceModel& surface, Points points);

/// Fewer than n inliers are left.
bool too_small(const Workspace& work, const SurfaceModel& surface);

}  // namespace octosurf
