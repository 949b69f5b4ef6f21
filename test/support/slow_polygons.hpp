#pragma once

#include "support/polygons.hpp"
#include "surfaces/surface_model.hpp"

namespace octosurf::test {

/// The alpha shape of all inliers and of boundary points, in the model's frame: what derive() must come to.
std::vector<Polygon> slow_polygons(const surfaces::SurfaceModel& model, double h,
                                   const surfaces::SurfaceModel::EdgeBleed& edge_bleed);
/// With the edge bleed of the model's last derive().
std::vector<Polygon> slow_polygons(const surfaces::SurfaceModel& model, double h);

}  // namespace octosurf::test
