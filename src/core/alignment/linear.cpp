#include "alignment/linear.hpp"

#include <Eigen/Dense>

namespace octosurf::alignment {

Twist solve(const TwistCovariance& A, const Twist& b) { return A.ldlt().solve(b); }
TwistCovariance inverse_of_definite(const TwistCovariance& A) {
  return A.ldlt().solve(TwistCovariance::Identity());
}
TwistCovariance inverse(const TwistCovariance& A) { return A.inverse(); }
SensorErrorCovariance inverse(const SensorErrorCovariance& A) { return A.inverse(); }

PrincipalAxes principal_axes(const TwistCovariance& A) {
  const Eigen::SelfAdjointEigenSolver<TwistCovariance> eigen(A);
  return {eigen.eigenvalues().reverse(), eigen.eigenvectors().rowwise().reverse()};
}

}  // namespace octosurf::alignment
