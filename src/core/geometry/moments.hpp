#pragma once

#include <Eigen/Eigenvalues>

namespace octosurf::geometry {

/// Count, mean and scatter of points, updated by adding and removing them. Relative to a nearby reference
/// point, so that a surface 100 m from the origin keeps full precision.
struct Moments {
  double count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();    ///< Σ w·(p − reference)
  Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();  ///< Σ w·(p − reference)(p − reference)ᵀ

  void add(const Eigen::Vector3d& relative, double weight = 1) {
    count += weight;
    sum += weight * relative;
    outer += weight * relative * relative.transpose();
  }
  void add(const Moments& other, double weight = 1) {
    count += weight * other.count;
    sum += weight * other.sum;
    outer += weight * other.outer;
  }
  /// The same points about reference + shift.
  Moments shifted(const Eigen::Vector3d& shift) const {
    Moments m = *this;
    m.sum -= count * shift;
    m.outer += count * shift * shift.transpose() - sum * shift.transpose() - shift * sum.transpose();
    return m;
  }
  Eigen::Vector3d mean() const { return sum / count; }
  Eigen::Matrix3d covariance() const {
    const Eigen::Vector3d m = mean();
    return outer / count - m * m.transpose();
  }
  /// Mean squared distance to the plane normal·x = offset (about the reference).
  double mean_squared_distance(const Eigen::Vector3d& normal, double offset) const {
    return std::max(0.0,
                    (normal.dot(outer * normal) - 2 * offset * normal.dot(sum)) / count + offset * offset);
  }
};

/// Total-least-squares plane through weighted points, relative to the moments' reference.
struct PlaneFit {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d variances = Eigen::Vector3d::Zero();  ///< ascending; [0] is along the normal
};

/// `moments.count` must be positive. Direct 3×3 eigen decomposition (closed form).
inline PlaneFit fit_plane(const Moments& moments) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(moments.covariance());
  return {moments.mean(), solver.eigenvectors().col(0), solver.eigenvalues().cwiseMax(0.0)};
}

}  // namespace octosurf::geometry
