#pragma once

#include "surfaces/surface_model.hpp"

#include <string>
#include <vector>

namespace octosurf::map_file {
class Surface;
}  // namespace octosurf::map_file

namespace octosurf::io {

/// Everything of `surface` except its inliers.
void write_surface(const surfaces::SurfaceModel::State& surface, map_file::Surface& record);

/// Valid references of a surface of a map file.
struct SurfaceBounds {
  double resolution = 0;       ///< m
  SurfaceId next_id = 1;       ///< all ids are below
  std::uint64_t revision = 0;  ///< the map's
  double max_hole_size = 0;    ///< m
};

/// Inverse; `inliers` are the octree's points with the record's id. Throws Error(data) unless every number is
/// present, finite and consistent with the others and with the inliers.
surfaces::SurfaceModel::State read_surface(const map_file::Surface& record,
                                           std::vector<surfaces::Inlier> inliers, const SurfaceBounds& bounds,
                                           const std::string& where);

}  // namespace octosurf::io
