#pragma once

#include "support/polygons.hpp"
#include "surfaces/surface_model.hpp"

#include <vector>

namespace octosurf::test {

/// The alpha shape of all inliers and of rim points, in the model's frame: what derive() must come to.
std::vector<Polygon> slow_polygons(const surfaces::SurfaceModel& model, double h,
                                   const surfaces::SurfaceModel::Overreach& overreach);
/// With the overreach of the model's last derive().
std::vector<Polygon> slow_polygons(const surfaces::SurfaceModel& model, double h);

}  // namespace octosurf::test
