#include "law/curvature.hpp"

#include "geometry/plane_frame.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace octosurf::law {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// rad. Feet stand on what turns by less: at its ends the normal is off by 6°, half of what shoes give way.
constexpr double least_turn = 0.2;

/// Σ w of {1, u, v, u²/2, uv, v²/2} and of heights over the patch's plane: weights of the noise alone,
/// because what readings have in common bends nothing.
struct QuadraticSums {
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
};

QuadraticSums sums_of(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices,
                      const Eigen::Matrix3d& R, const Eigen::Vector3d& origin) {
  QuadraticSums sums;
  for (const Readings::Index i : indices) {
    const Reading& r = readings[i];
    const Eigen::Vector3d p = R * (r.position.cast<double>() - origin);
    Vector6 basis;
    basis << 1, p.x(), p.y(), 0.5 * p.x() * p.x(), p.x() * p.y(), 0.5 * p.y() * p.y();
    const double w = 1 / readings.model().independent_variance(r.range_class, r.facing(patch.plane));
    sums.normal += w * basis * basis.transpose();
    sums.right += w * p.z() * basis;
  }
  return sums;
}

/// By how much the surface u²κ_u/2 + uvκ_uv + v²κ_v/2 turns over readings that scatter by `spread` (m²) along
/// its two axes: a uniform strip is √12 deviations long.
double turn_of(const Eigen::Vector3d& bend, const Eigen::Matrix2d& spread) {
  Eigen::Matrix2d hessian;
  hessian << bend[0], bend[1], bend[1], bend[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(hessian);
  double most = 0;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d along = axes.eigenvectors().col(k);
    most = std::max(most, std::fabs(axes.eigenvalues()[k]) * std::sqrt(12 * along.dot(spread * along)));
  }
  return most;
}

}  // namespace

bool is_curved(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices) {
  const Eigen::Matrix3d R = geometry::plane_axes(patch.plane.normal).transpose();
  const QuadraticSums sums = sums_of(readings, patch, indices, R, patch.centroid());
  // Bends once offset and slopes are eliminated (Schur's complement).
  const Eigen::Matrix3d plane = sums.normal.topLeftCorner<3, 3>(), mixed = sums.normal.topRightCorner<3, 3>();
  const Eigen::LDLT<Eigen::Matrix3d> solver(plane);
  const Eigen::Matrix3d information =
      sums.normal.bottomRightCorner<3, 3>() - mixed.transpose() * solver.solve(mixed);
  const Eigen::Vector3d right =
      sums.right.tail<3>() - mixed.transpose() * solver.solve(Eigen::Vector3d(sums.right.head<3>()));
  // Before any reading a bend may turn the patch by about 1 rad from end to end.
  const Eigen::Matrix2d spread = (R * patch.moments.covariance() * R.transpose()).topLeftCorner<2, 2>();
  const double prior = 12 * spread.trace();
  const Eigen::Matrix3d posterior = information + prior * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d bend = posterior.ldlt().solve(right);
  const double log_bayes = 0.5 * (right.dot(bend) - std::log((posterior / prior).determinant()));
  return log_bayes > 0 && turn_of(bend, spread) > least_turn;
}

}  // namespace octosurf::law
