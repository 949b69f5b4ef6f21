#pragma once

#include "surfaces/map_state.hpp"
#include "surfaces/shared_readings.hpp"

#include <cstdint>
#include <map>
#include <vector>

namespace octosurf {

/// Ids for the surfaces and cylinders of a rebuilt map.
struct Identities {
  std::map<SurfaceId, SurfaceId> surfaces;              ///< id in the new map → assigned id
  std::map<SurfaceId, std::vector<SurfaceId>> parents;  ///< of each, by assigned id
  std::map<SurfaceId, std::uint64_t> surfaces_born;     ///< likewise
  std::map<CylinderId, std::uint64_t> cylinders_born;   ///< likewise
  std::map<SurfaceId, SurfaceId> merged;  ///< removed surfaces → assigned id of the absorbing one
  SurfaceId next_surface = 1;
  std::map<CylinderId, CylinderId> cylinders;
  CylinderId next_cylinder = 1;
  std::uint64_t revision = 0;
  RemovalLog removals;  ///< the old map's, and those added by the rebuild

  // Numbers of surfaces, for the report.
  std::size_t kept = 0, born = 0;
  std::vector<SurfaceId> gone;  ///< old surfaces whose id is not used any more
};

/// Matches the surfaces of a map that was rebuilt from the same readings at corrected poses with those of the
/// old map, so that ids remain valid.
///
/// Every reading lies in a voxel of the old map and in one of the new. A surface keeps the id of the one that
/// it continues (SharedReadings::pairs()); without one it gets an unused id. Cylinders likewise.
///
/// Lineage: a surface that keeps its id keeps its parents. Old surfaces without a partner, at least half of
/// whose readings lie in it now, are added as parents: they merged into it. The parent of a surface with a
/// new id is the old surface that has at least half of its readings, if any: it was split from that. Surfaces
/// that existed only during the rebuild are not recorded.
class Succession {
 public:
  /// Both must outlive it.
  Succession(const surfaces::MapState& before, const surfaces::MapState& after)
      : before_(before), after_(after) {}

  /// Records a point by its voxel in the old map and in the new one. O(1).
  void add(geometry::VoxelKey before, geometry::VoxelKey after);
  /// Records a point that is outside the new map.
  void add_lost(geometry::VoxelKey before);

  /// Throws Error(data) if ids run out.
  Identities settle() const;

 private:
  void settle_parents(Identities& identities) const;
  void settle_removals(Identities& identities) const;

  const surfaces::MapState& before_;
  const surfaces::MapState& after_;
  surfaces::SharedReadings surfaces_, cylinders_;
};

/// Applies `identities` to a map: octree, stores, lineage, snapshot. Everything is marked as changed in its
/// revision.
void renumber(surfaces::MapState& state, const Identities& identities);

}  // namespace octosurf
