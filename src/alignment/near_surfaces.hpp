#pragma once

#include "alignment/plane_raster.hpp"

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// What alignment keeps of a surface, as of one of its revisions.
struct AlignedSurface {
  AlignedSurface(const Surface& surface, double edge);

  Plane plane;
  Eigen::Isometry3d T_surface_map;
  /// Of slope along u, slope along v and offset at the surface's origin, as Surface::covariance, which knows
  /// the readings' noise, with what the plane may be off because its rim is mixed with what lies beyond it.
  Eigen::Matrix3d covariance;
  PlaneRaster raster;
};

/// The surfaces of a map with their rasters, which are made when a scan first comes near a surface and again
/// after it changed.
class NearSurfaces {
 public:
  /// Those of the snapshot whose box meets `box` (map frame), ascending id; valid until the next call.
  /// O(surfaces), plus the rasters of those that changed.
  std::vector<const AlignedSurface*> in(const Snapshot& snapshot, const Eigen::AlignedBox3d& box);

 private:
  struct Entry {
    SurfacePtr surface;
    Eigen::AlignedBox3d box;
    std::unique_ptr<const AlignedSurface> aligned;
  };
  void follow(const Snapshot& snapshot);

  std::vector<Entry> entries_;  ///< one a surface of the snapshot asked last, ascending id
};

}  // namespace octosurf
