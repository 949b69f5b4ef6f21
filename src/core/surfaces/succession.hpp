#pragma once

#include "surfaces/map_state.hpp"
#include "surfaces/shared_readings.hpp"

#include <cstddef>
#include <optional>
#include <vector>

namespace octosurf::surfaces {

/// Surfaces of a map that was rebuilt, by what became of the old map's.
struct Succeeded {
  std::size_t kept = 0, born = 0;
  std::vector<SurfaceId> gone;  ///< old surfaces whose id is not used any more
};

/// Gives the surfaces and cylinders of a map that was rebuilt from the same readings at corrected poses the
/// ids of those of the old map. A surface keeps the id that SharedReadings::keepers() says; without one it
/// gets an unused id, and the old surface that had more than half of its readings as parent. An old surface
/// without a successor of its id merged into the one with most of its readings.
class Succession {
 public:
  /// Must outlive it.
  explicit Succession(const MapState& before) : before_(before) {}

  /// Records a point by its voxels in the old map and in the new one, if it is in that. O(1).
  void add(geometry::VoxelKey before, const MapState& after, std::optional<geometry::VoxelKey> now);

  /// Octree, stores, lineage, snapshot; everything is marked as changed in one revision after the old map's.
  /// Throws Error(data) if ids run out.
  Succeeded renumber(MapState& after) const;

 private:
  const MapState& before_;
  SharedReadings surfaces_, cylinders_;
};

/// Publishes a map whose stores were filled anew: each surface at the revision of its last change.
/// O(surfaces and cylinders).
void publish_whole(MapState& state);

}  // namespace octosurf::surfaces
