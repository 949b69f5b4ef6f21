#pragma once

#include "surfaces/map_state.hpp"

#include <cstdint>
#include <map>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::mapper {

/// What the surfaces and cylinders of a map that was built anew are to be called.
struct Identities {
  std::map<SurfaceId, SurfaceId> surfaces;  ///< as the new map has numbered them → as they are to be called
  std::map<SurfaceId, std::vector<SurfaceId>> parents;  ///< of each, by what it is to be called
  std::map<SurfaceId, std::uint64_t> surfaces_born;     ///< likewise
  std::map<CylinderId, std::uint64_t> cylinders_born;   ///< likewise
  std::map<SurfaceId, SurfaceId> merged;  ///< of the gone: into which, by what it is to be called
  SurfaceId next_surface = 1;
  std::map<CylinderId, CylinderId> cylinders;
  CylinderId next_cylinder = 1;
  std::uint64_t revision = 0;
  DepartureLog departures;  ///< the old map's, and what it has that the new one has not

  // Counts of surfaces, for the user.
  std::size_t kept = 0, born = 0;
  std::vector<SurfaceId> gone;  ///< of the old map, without an heir of that name
};

/// Tells which surfaces of a map that was built anew, from the same readings at other poses, are which of the
/// old one: whoever holds an id keeps hold of it.
///
/// Every reading lies in some voxel of the old map and in one of the new. An old and a new surface are the
/// same if at least half of the smaller one's readings lie in the other: so few enough are astray that no
/// third surface can hold more of them. Of a larger surface several smaller ones may hold for that, what it
/// fell into or was made of: it goes with the one with which it shares most readings, and of pairs that share
/// as many, with lower ids. Each surface has at most one partner; what has none gets an id that was never
/// used. Cylinders likewise.
///
/// Lineage: a surface that keeps its id keeps its parents. Old surfaces that lost theirs, and at least half
/// of whose readings lie in it now, are added: it is what they were merged into. A new one's parent is the
/// old surface that holds at least half of its readings, if there is one: it was split from that. What came
/// and went while the map was built anew was never seen by anyone, and is no one's parent.
class Succession {
 public:
  /// Both must outlive it.
  Succession(const surfaces::MapState& before, const surfaces::MapState& after)
      : before_(before), after_(after) {}

  /// A point in the voxel where the old map has it and in that where the new one has it. O(1).
  void add(geometry::VoxelKey before, geometry::VoxelKey after);
  /// A point that is outside the new map.
  void add_lost(geometry::VoxelKey before);

  /// Throws Error(data) if the ids run out.
  Identities settle() const;

 private:
  using Id = std::uint32_t;  // of surfaces and of cylinders
  /// Readings in pairs of an old and a new thing, and in all of each.
  struct Shared {
    void add(Id before, Id after);

    tsl::robin_map<std::uint64_t, std::uint64_t, geometry::PackedKeyHash> pairs;
    std::map<Id, std::uint64_t> of_before, of_after;
  };
  static std::map<Id, Id> partners(const Shared& shared);
  void settle_parents(Identities& identities) const;
  void settle_departures(Identities& identities) const;

  const surfaces::MapState& before_;
  const surfaces::MapState& after_;
  Shared surfaces_, cylinders_;
};

/// Calls the surfaces and cylinders of a map as `identities` says, everywhere: octree, stores, lineage,
/// snapshot. All have changed with its revision.
void renumber(surfaces::MapState& state, const Identities& identities);

}  // namespace octosurf::mapper
