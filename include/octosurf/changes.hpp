#pragma once

#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Changes of surfaces and cylinders since an earlier revision. Ids ascend.
struct MapChanges {
  std::uint64_t since = 0;     ///< the earlier revision
  std::uint64_t revision = 0;  ///< of the snapshot

  std::vector<SurfaceId> appeared;  ///< new since then, including those split off from others
  std::vector<SurfaceId> changed;   ///< still present, with another plane, polygon or covariance
  std::vector<SurfaceId> gone;      ///< removed without a successor

  /// A surface or cylinder of the earlier revision and one of now that contains all or part of it.
  struct Successor {
    SurfaceId before = 0;  ///< id at the earlier revision
    SurfaceId now = 0;     ///< id now
    friend bool operator==(const Successor&, const Successor&) = default;
  };
  /// `before` no longer exists; sorted by `before`, then `now`. A split followed by a merger may give
  /// several.
  std::vector<Successor> merged;
  /// `before` still exists, and `now`, another surface, has a part of it; sorted likewise.
  std::vector<Successor> split;

  std::vector<CylinderId> cylinders_appeared;  ///< as for surfaces
  std::vector<CylinderId> cylinders_changed;   ///< likewise
  std::vector<CylinderId> cylinders_gone;      ///< likewise
  std::vector<Successor> cylinders_merged;     ///< as `merged`
};

/// Net changes after revision `since`, over any number of scans, splits and mergers: a client that drops
/// `gone` and every `before` of `merged`, and rereads `appeared` and `changed`, has the snapshot's surfaces.
/// Surfaces that appeared and disappeared in between are not listed,
/// but surfaces that took them in still count as their successors.
///
/// Throws Error(usage) if `since` is later than the snapshot, Error(data) if it is neither 0
/// nor as late as Snapshot::removals reaches back. O(surfaces), some ns each, and O(changes).
MapChanges changes_since(const Snapshot& snapshot, std::uint64_t since);

}  // namespace octosurf
