#include "geometry/plane_frame.hpp"

#include <cmath>

namespace octosurf::geometry {

Eigen::Matrix3d plane_axes(const Eigen::Vector3d& normal) {
  Eigen::Matrix3d axes;
  axes.col(2) = normal;
  // All directions in a level plane are horizontal: x is then the one nearest to the map's.
  const bool level = std::hypot(normal.x(), normal.y()) < 1e-6;
  axes.col(0) = level ? Eigen::Vector3d(Eigen::Vector3d::UnitY().cross(normal).normalized())
                      : Eigen::Vector3d(Eigen::Vector3d::UnitZ().cross(normal).normalized());
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

Plane fitted_plane(const Moments& moments, const Eigen::Vector3d& reference, const Eigen::Vector3d& toward) {
  const PlaneFit fit = fit_plane(moments);
  Plane plane{fit.normal, 0};
  if (plane.normal.dot(toward) < 0) plane.normal = -plane.normal;
  plane.offset = plane.normal.dot(reference + fit.centroid);
  return plane;
}

double width_of(const Moments& moments) { return std::sqrt(12 * fit_plane(moments).variances[1]); }

}  // namespace octosurf::geometry
