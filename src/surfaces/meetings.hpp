#pragma once

#include "surfaces/surface_store.hpp"

#include <Eigen/Core>
#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::surfaces {

/// Where a surface's rim goes on until it meets another surface. Of two faces that meet at an edge, the
/// voxels along it are one's or the other's, and sparse readings leave a strip to both sides of it; but each
/// ends where it meets the other's plane, and that line is as exact as the two planes.
///
/// A rim goes on to the line from an inlier if the line lies no farther off than the next reading would: as
/// far as the last row of inliers before it, and a voxel, which may be the other's; if the other's inliers
/// begin as near to the same place; and if nothing that is farther than the outline would bridge (`gap`, m)
/// lies between.
class Meetings {
 public:
  Meetings(const SurfaceModel& surface, const SurfaceStore& surfaces, double gap)
      : surface_(surface), surfaces_(surfaces), gap_(gap) {}

  /// Finds the surfaces that may be met from a tile of 8 × 8 cells of the surface's hash; points_from() asks
  /// about these. False if there is none. Cost: a few look-ups of a region, and of blocks
  /// where another plane passes.
  bool look_about(geometry::PlaneCell tile);
  /// On the surface's plane: where it meets others, going straight on from one of its inliers, and where
  /// three planes meet. Empties `points` first. Cost: some look-ups of a cell for each of the surfaces found.
  void points_from(const Inlier& inlier, std::vector<Eigen::Vector3d>& points) const;

 private:
  struct Other {
    const SurfaceModel* surface;
    Eigen::Vector3d toward;  ///< unit, in the plane, along which the distance to the other's plane grows
    double sine;             ///< of the angle between the two
  };
  const std::vector<SurfaceId>& in_regions_near(geometry::VoxelKey key, int reach);
  bool begins_near(const Other& other, const Eigen::Vector3d& at) const;

  const SurfaceModel& surface_;
  const SurfaceStore& surfaces_;
  double gap_;
  std::vector<Other> others_;
  tsl::robin_map<std::uint64_t, std::vector<SurfaceId>, geometry::PackedKeyHash>
      in_regions_;  // what was looked up before, by the first and last
};

}  // namespace octosurf::surfaces
