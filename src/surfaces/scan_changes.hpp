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

/// One scan's working set, handed from stage to stage. Every move of a point between a surface and
/// pending goes through give() and take_back(), which keep octree, surfaces and records in step.
class Workspace {
 public:
  using Index = PointWindow::Index;

  explicit Workspace(MapState& map_state) : Workspace(map_state, PointWindow(map_state.occupancy)) {}
  /// On another octree's points than the state's own.
  Workspace(MapState& map_state, PointWindow points)
      : state(map_state),
        window(std::move(points)),
        normals(window, map_state.parameters, map_state.noise, map_state.surfaces) {}

  MapState& state;
  PointWindow window;
  NormalField normals;
  Changes changes;
  std::vector<VoxelKey> returned;  ///< points that went back to pending: detection looks at them again

  /// What plane detection looked at and may not have taken: for cylinders.
  struct LeftOver {
    std::vector<std::vector<Index>> regions;  ///< smooth ones, key order each
    std::vector<Index> points;                ///< that waited for detection
  } left_over;

  void give(Index i, SurfaceModel& surface) {
    const VoxelPoint& p = window[i];
    if (p.surface == 0) state.cylinders.release(p.key);
    state.surfaces.add(surface, {p.key, p.range_class, p.position});
    window.assign(i, surface.id());
    changes.grown.insert(surface.id());
  }
  void take_back(Index i) {
    const VoxelPoint& p = window[i];
    SurfaceModel& surface = *state.surfaces.find(p.surface);
    state.surfaces.remove(surface, p.key, p.position);
    changes.shrunk.insert(p.surface);
    returned.push_back(p.key);
    window.assign(i, 0);
  }
};

}  // namespace octosurf
