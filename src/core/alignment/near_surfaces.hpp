#pragma once

#include "alignment/plane_raster.hpp"

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {
struct MapState;
class SurfaceModel;
}  // namespace octosurf::surfaces

namespace octosurf::alignment {

/// Alignment's data of a surface, at one of its revisions.
struct AlignedSurface {
  /// The raster covers `window` (u, v). `model`: the surface's in the map under construction, or null.
  AlignedSurface(const Surface& surface, const surfaces::SurfaceModel* model, double max_hole_size,
                 double edge, const Eigen::AlignedBox2d& window);

  Plane plane;
  Eigen::Isometry3d T_surface_map;
  /// Error of the plane by mixed readings at its boundary: covariance of slope along u, slope along v and
  /// offset at the surface's origin.
  Eigen::Matrix3d by_boundary;
  Eigen::Matrix3d covariance;  ///< total: from its readings' noise, and by_boundary
  PlaneRaster raster;
};

/// The surfaces of a map with their rasters, which are built when a scan first comes near a surface and
/// rebuilt after it changed.
class NearSurfaces {
 public:
  /// Those of the snapshot whose box meets `box` (map frame), ascending id; valid until the next call.
  /// Covariances are from their readings' scatter (covariance_of_readings()) if the snapshot is that of the
  /// `growing` map, as published otherwise. Their rasters cover `box` only. O(surfaces), plus the rasters of
  /// those that changed, and of those of which another part is near.
  std::vector<const AlignedSurface*> in(const Snapshot& snapshot, const Eigen::AlignedBox3d& box,
                                        const surfaces::MapState* growing = nullptr);

 private:
  struct Entry {
    SurfacePtr surface;
    Eigen::AlignedBox3d box;
    std::unique_ptr<AlignedSurface> aligned;
  };
  void follow(const Snapshot& snapshot, const surfaces::MapState* growing);

  std::vector<Entry> entries_;  ///< one per surface of the last snapshot, ascending id
};

}  // namespace octosurf::alignment
