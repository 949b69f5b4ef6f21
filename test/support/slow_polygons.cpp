#include "support/slow_polygons.hpp"

#include "support/alpha_shape_twin.hpp"

namespace octosurf::test {

std::vector<Polygon> slow_polygons(const surfaces::SurfaceModel& model, double h,
                                   const surfaces::SurfaceModel::EdgeBleed& edge_bleed) {
  std::vector<Eigen::Vector2d> points = model.intersection_sites();
  for (const surfaces::Inlier& inlier : model.sorted_inliers()) {
    points.push_back(model.outline_point(inlier.position));
    if (const auto boundary = model.boundary_point(inlier, edge_bleed[inlier.range_class]))
      points.push_back(model.outline_point(*boundary));
  }
  std::vector<Polygon> polygons = alpha_shape(points, model.outline_alpha(h));
  const Eigen::Affine2d T = model.T_surface_outline();
  for (Polygon& polygon : polygons) {
    for (Eigen::Vector2d& p : polygon.outer) p = T * p;
    for (Ring2& hole : polygon.holes)
      for (Eigen::Vector2d& p : hole) p = T * p;
  }
  return polygons;
}

std::vector<Polygon> slow_polygons(const surfaces::SurfaceModel& model, double h) {
  return slow_polygons(model, h, model.edge_bleed());
}

}  // namespace octosurf::test
