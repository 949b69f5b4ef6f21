#pragma once

#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// What became of the surfaces and cylinders that somebody knew at an earlier revision. Ids ascend.
struct MapChanges {
  std::uint64_t since = 0;     ///< the earlier revision
  std::uint64_t revision = 0;  ///< the snapshot's

  std::vector<SurfaceId> appeared;  ///< were not there; those split from others among them
  std::vector<SurfaceId> changed;   ///< were there and are, with another plane, polygon or covariance
  std::vector<SurfaceId> gone;      ///< were there, and nothing that is there holds them now

  /// A surface that was there, and one that is there now and holds all or a part of it.
  struct Heir {
    SurfaceId before = 0;  ///< id at the earlier revision
    SurfaceId now = 0;     ///< id now
    friend bool operator==(const Heir&, const Heir&) = default;
  };
  /// `before` is no more; by `before`, then `now`. After a split and a merger there may be several.
  std::vector<Heir> merged;
  /// `before` is still there, and `now`, another one, has a part of it; likewise.
  std::vector<Heir> split;

  std::vector<CylinderId> cylinders_appeared;  ///< as of surfaces
  std::vector<CylinderId> cylinders_changed;   ///< likewise
  std::vector<CylinderId> cylinders_gone;      ///< likewise
  /// As Heir, of cylinders.
  struct CylinderHeir {
    CylinderId before = 0;  ///< id at the earlier revision
    CylinderId now = 0;     ///< id now
    friend bool operator==(const CylinderHeir&, const CylinderHeir&) = default;
  };
  std::vector<CylinderHeir> cylinders_merged;  ///< as `merged`
};

/// Everything that happened after revision `since`, over any number of scans, splits and mergers in between:
/// who drops `gone` and every `before` of `merged`, and reads `appeared` and `changed` anew, has what the
/// snapshot has. What came and went within that time is not told, but followed. Of surfaces of a map that was
/// saved before maps noted when a surface appeared, those are taken to have been there.
///
/// Throws Error(usage) if `since` is a revision to come. O(surfaces), some ns each, and O(changes).
MapChanges changes_since(const Snapshot& snapshot, std::uint64_t since);

/// A surface of one of two maps, and how much of it the other map has, too.
struct SurfaceDifference {
  SurfaceId id = 0;      ///< in its own map
  double area_m2 = 0;    ///< of its polygons
  double shared_m2 = 0;  ///< of that, over or under a polygon of the other map's, see compare_maps()
  double free_m2 = 0;    ///< of the rest, in space that the other map's octree has seen free: it is gone
  double unseen_m2 = 0;  ///< of the rest, in space that the other map has not seen: nobody knows
  SurfaceId other = 0;   ///< the other map's that holds most of it; 0: none
  double offset_m = 0;   ///< of `other` from it along its normal, in the middle of what they share
  double angle_rad = 0;  ///< between the normals
};

/// What compare_maps() found.
struct MapDifference {
  std::vector<SurfaceDifference> before;  ///< every surface of the first map, ascending id
  std::vector<SurfaceDifference> after;   ///< and of the second
};

/// Compares two maps of one place as they lie, whoever made them and whatever their ids: a point of a surface
/// is shared if the other map has a surface of about the same normal (to 20°, more than noise tilts a plane
/// of n points) over or under it within `tolerance` (0: twice the coarser d). What else the other map knows
/// of such a place, its octree says, if its snapshot has one (Snapshot::octree): free, unseen, or something
/// else that is there. Sampled on a grid of the coarser d. Throws Error(usage) for a tolerance that is not
/// finite and positive. O(area / d² × surfaces near).
MapDifference compare_maps(const Snapshot& before, const Snapshot& after, double tolerance = 0);

}  // namespace octosurf
