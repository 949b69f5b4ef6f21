#include "geometry/planarity.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace octosurf::geometry {

void Planarity::add(const Eigen::Vector3f& position, double sigma, double tolerance, bool inner) {
  const Eigen::Vector3d q = T_surface_map_ * Eigen::Vector3d(position.cast<double>());
  ++count_;
  squares_ += q.z() * q.z() / (sigma * sigma);
  tolerances_ += tolerance;
  if (!inner) return;
  ++inner_;
  Vector6d row;
  row << 1, q.x(), q.y(), q.x() * q.x(), q.x() * q.y(), q.y() * q.y();
  normal_matrix_ += row * row.transpose();
  right_side_ += q.z() * row;
  inner_moments_.add({q.x(), q.y(), 0});
}

bool Planarity::bends() const {
  constexpr std::size_t min_points = 12;  // twice the quadric's unknowns
  constexpr double largest_radius = 1;    // m
  constexpr double share = 0.4;           // of the tolerance
  // Noise averages out over a patch, so the bend of a far pillar's facet shows although it is smaller than
  // the tolerance of its points.
  constexpr double largest_tolerance = 0.025;  // m
  constexpr double least_turn = 0.3;  // rad: a cushion bulges by 13°, a pillar's facet turns by 28° and more
  if (inner_ < min_points) return false;
  const Vector6d c = normal_matrix_.ldlt().solve(right_side_);
  Eigen::Matrix2d hessian;
  hessian << 2 * c[3], c[4], c[4], 2 * c[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal(hessian);
  const Eigen::Matrix2d covariance = inner_moments_.covariance().topLeftCorner<2, 2>();
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d axis = principal.eigenvectors().col(k);
    const double length_sq = 12 * axis.dot(covariance * axis);  // if they are spread uniformly
    const double curvature = std::fabs(principal.eigenvalues()[k]);
    if (curvature * largest_radius > 1 && curvature * std::sqrt(length_sq) > least_turn &&
        curvature * length_sq / 8 > share * std::min(mean_tolerance(), largest_tolerance))
      return true;
  }
  return false;
}

}  // namespace octosurf::geometry
