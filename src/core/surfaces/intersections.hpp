#pragma once

#include "surfaces/surface_store.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::surfaces {

/// Extends a surface's boundary to its intersection with other surfaces. At an edge of two faces, its voxels
/// belong to one or the other, and sparse readings leave a strip on both sides; but each face ends at the
/// other's plane, and that line is as exact as the two planes.
///
/// It is extended from an inlier to the line if the line is no farther than the next reading would be: the
/// distance to the previous row of inliers, plus one voxel that may be the other's; if the other's inliers
/// start as near to the same place; and if there is no gap wider than the outline would bridge (`gap`, m).
class Intersections {
 public:
  Intersections(const SurfaceModel& surface, const SurfaceStore& surfaces, double gap)
      : surface_(surface), surfaces_(surfaces), gap_(gap) {}

  /// Finds the surfaces that may be met from a tile of 8 × 8 cells of the surface's hash, for points_from().
  /// False if there is none. Cost: a few look-ups of a region, and of blocks where another plane passes.
  bool look_about(geometry::PlaneCell tile);
  /// On the surface's plane: its intersections with others straight on from one of its inliers, and those of
  /// three planes. Empties `points` first. Cost: some look-ups of a cell for each of the surfaces found.
  void points_from(const Inlier& inlier, std::vector<Eigen::Vector3d>& points) const;

 private:
  struct Other {
    const SurfaceModel* surface;
    Eigen::Vector3d toward;  ///< unit, in the plane, of increasing distance to the other's plane
    double sine;             ///< of the angle between the two
  };
  const std::vector<SurfaceId>& in_regions_near(geometry::VoxelKey key, int reach);
  bool begins_near(const Other& other, const Eigen::Vector3d& at) const;

  const SurfaceModel& surface_;
  const SurfaceStore& surfaces_;
  double gap_;
  std::vector<Other> others_;
  tsl::robin_map<std::uint64_t, std::vector<SurfaceId>, geometry::PackedKeyHash>
      in_regions_;  // cache of earlier look-ups, by first and last
};

}  // namespace octosurf::surfaces
