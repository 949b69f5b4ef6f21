#pragma once

#include "alignment/plane_raster.hpp"

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {
class SurfaceStore;
}  // namespace octosurf::surfaces

namespace octosurf::sensing {
class NoiseModel;
}  // namespace octosurf::sensing

namespace octosurf::alignment {

/// What alignment keeps of a surface, as of one of its revisions.
struct AlignedSurface {
  /// The raster is that of `window` (u, v).
  AlignedSurface(const Surface& surface, double edge, const Eigen::AlignedBox2d& window);

  Plane plane;
  Eigen::Isometry3d T_surface_map;
  /// What the plane may be off because its rim is mixed with what lies beyond it: covariance of slope along
  /// u, slope along v and offset at the surface's origin.
  Eigen::Matrix3d by_rim;
  Eigen::Matrix3d covariance;  ///< the same of all that is known: by its readings' noise, and by_rim
  PlaneRaster raster;
};

/// A map that is being built: what its snapshot does not tell of the surfaces.
struct GrowingMap {
  const surfaces::SurfaceStore& surfaces;
  const sensing::NoiseModel& noise;
};

/// The surfaces of a map with their rasters, which are made when a scan first comes near a surface and again
/// after it changed.
class NearSurfaces {
 public:
  /// Those of the snapshot whose box meets `box` (map frame), ascending id; valid until the next call. As
  /// sure as their readings' scatter says (covariance_of_readings()) if the snapshot is that of the `growing`
  /// map, as sure as published otherwise. Their rasters tell of what is within `box` only. O(surfaces), plus
  /// the rasters of those that changed, and of those of which another part is near.
  std::vector<const AlignedSurface*> in(const Snapshot& snapshot, const Eigen::AlignedBox3d& box,
                                        const GrowingMap* growing = nullptr);

 private:
  struct Entry {
    SurfacePtr surface;
    Eigen::AlignedBox3d box;
    std::unique_ptr<AlignedSurface> aligned;
  };
  void follow(const Snapshot& snapshot);

  std::vector<Entry> entries_;  ///< one a surface of the snapshot asked last, ascending id
};

}  // namespace octosurf::alignment
