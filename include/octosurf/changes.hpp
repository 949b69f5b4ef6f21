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
    std::uint32_t before = 0;  ///< id at the earlier revision
    std::uint32_t now = 0;     ///< id now
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
/// Throws Error(usage) if `since` is later than the snapshot. O(surfaces), some ns each, and O(changes).
MapChanges changes_since(const Snapshot& snapshot, std::uint64_t since);

/// A surface of one of two maps, and how much of it the other map also has.
struct SurfaceDifference {
  SurfaceId id = 0;      ///< in its own map
  double area_m2 = 0;    ///< of its polygons
  double shared_m2 = 0;  ///< part of it over or under a polygon of the other map, see compare_maps()
  double free_m2 = 0;    ///< of the rest, in space that the other map observed as free: it was removed
  double unseen_m2 = 0;  ///< of the rest, in space that the other map has not observed
  SurfaceId other = 0;   ///< surface of the other map that covers most of it; 0: none
  double offset_m = 0;   ///< distance of `other` along this normal, at the centre of the shared area
  double angle_rad = 0;  ///< between the normals
};

/// Result of compare_maps().
struct MapDifference {
  std::vector<SurfaceDifference> before;  ///< every surface of the first map, ascending id
  std::vector<SurfaceDifference> after;   ///< every surface of the second
};

/// Compares two maps of one place in their common frame, whatever their origin and ids. A point of a surface
/// is shared if the other map has a surface of about the same normal (to 20°, more than noise tilts a plane
/// of n points) over or under it within `tolerance` (0: twice the coarser d). Elsewhere the other map's
/// octree decides, if its snapshot has one (Snapshot::octree): free, unseen or occupied otherwise. Sampled on
/// a grid of the coarser d. Throws Error(usage) for a tolerance that is not finite and positive. O(area / d²
/// × surfaces near).
MapDifference compare_maps(const Snapshot& before, const Snapshot& after, double tolerance = 0);

}  // namespace octosurf
