#include "law/curvature.hpp"

#include "geometry/plane_frame.hpp"

#include <Eigen/Dense>
#include <algorithm>
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

/// Rotation from the map to u across a patch, v along it, and its normal.
struct PrincipalFrame {
  Eigen::Matrix3d R;
  Eigen::Vector2d variances;  ///< of its readings across and along, m²
  double pose_variance;       ///< of what its readings have in common, m²

  explicit PrincipalFrame(const Patch& patch)
      : R(geometry::plane_axes(patch.plane.normal).transpose()), pose_variance(patch.pose_variance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(
        (R * patch.moments.covariance() * R.transpose()).topLeftCorner<2, 2>());
    R.topRows<2>() = (axes.eigenvectors().transpose() * R.topRows<2>()).eval();
    variances = axes.eigenvalues().cwiseMax(0.0);
  }

  /// Squared lengths that bends act over, m²: across, both, along; a uniform strip is √12 deviations long.
  Eigen::Vector3d lengths2() const {
    return 12 * Eigen::Vector3d(variances[0], std::sqrt(variances.prod()), variances[1]);
  }
  /// Variance (1/m²) of bends that no number of readings averages out, because those in the middle may be off
  /// in common against those at both ends: with L²κ/8 between them, 64·(1 + ½)·σ² / L⁴; and two corners
  /// against the other two for the twist, 4·σ² / L⁴.
  Eigen::Vector3d common_variance() const {
    return (pose_variance * Eigen::Array3d(96, 4, 96) / lengths2().array().square().max(1e-12)).matrix();
  }
};

/// By how much the surface u²κ_u/2 + uvκ_uv + v²κ_v/2 turns over readings that scatter so along its two axes
/// (m²).
double turn_of(const Eigen::Vector3d& bend, const Eigen::Vector2d& variances) {
  Eigen::Matrix2d hessian;
  hessian << bend[0], bend[1], bend[1], bend[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(hessian);
  double most = 0;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d along = axes.eigenvectors().col(k);
    most = std::max(
        most, std::fabs(axes.eigenvalues()[k]) * std::sqrt(12 * along.dot(variances.cwiseProduct(along))));
  }
  return most;
}

}  // namespace

bool is_curved(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices) {
  const PrincipalFrame frame(patch);
  const Eigen::Matrix3d& R = frame.R;
  const QuadraticSums sums = sums_of(readings, patch, indices, R, patch.centroid());
  // Bends once offset and slopes are eliminated (Schur's complement).
  const Eigen::Matrix3d plane = sums.normal.topLeftCorner<3, 3>(), mixed = sums.normal.topRightCorner<3, 3>();
  const Eigen::LDLT<Eigen::Matrix3d> solver(plane);
  const Eigen::Matrix3d by_noise =
      sums.normal.bottomRightCorner<3, 3>() - mixed.transpose() * solver.solve(mixed);
  const Eigen::Vector3d right =
      sums.right.tail<3>() - mixed.transpose() * solver.solve(Eigen::Vector3d(sums.right.head<3>()));
  const Eigen::Matrix3d kept =
      (Eigen::Matrix3d::Identity() + by_noise * Eigen::Matrix3d(frame.common_variance().asDiagonal()))
          .inverse();
  const Eigen::Matrix3d information = kept * by_noise;
  const Eigen::Vector3d evidence = kept * right;
  // Before any reading a bend may turn the patch by about 1 rad from end to end, along and across.
  const Eigen::Vector3d prior = frame.lengths2();
  const Eigen::Matrix3d posterior = information + Eigen::Matrix3d(prior.asDiagonal());
  const Eigen::Vector3d bend = posterior.ldlt().solve(evidence);
  const auto one_way = [&](int k) {
    return 0.5 * (evidence[k] * evidence[k] / posterior(k, k) - std::log(posterior(k, k) / prior[k]));
  };
  const double any_way = 0.5 * (bend.dot(evidence) - std::log(posterior.determinant() / prior.prod()));
  constexpr double log_three = 1.0986122886681098;  // across, along, any way: none is likelier beforehand
  const double log_bayes = std::max({one_way(0), one_way(2), any_way}) - log_three;
  return log_bayes > 0 && turn_of(bend, frame.variances) > least_turn;
}

}  // namespace octosurf::law
