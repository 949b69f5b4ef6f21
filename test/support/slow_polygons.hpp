#pragma once

#include "support/polygons.hpp"
#include "surfaces/alpha_shape.hpp"
#include "surfaces/surface_model.hpp"

#include <vector>

namespace octosurf::test {

/// The alpha shape of all inliers, in the model's frame: what derive() must come to.
inline std::vector<Polygon> slow_polygons(const SurfaceModel& model, double h) {
  const Eigen::Isometry3d T_surface_map = model.pose().inverse();
  std::vector<Eigen::Vector2d> points;
  for (const Inlier& inlier : model.sorted_inliers())
    points.push_back((T_surface_map * Eigen::Vector3d(inlier.position.cast<double>())).head<2>());
  return alpha_shape(points, h);
}

/// In one polygons, not in the other, m².
inline double difference(const std::vector<Polygon>& a, const std::vector<Polygon>& b) {
  BgMultiPolygon only;
  bg::sym_difference(to_boost(a), to_boost(b), only);
  return bg::area(only);
}

}  // namespace octosurf::test
