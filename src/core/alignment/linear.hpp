#pragma once

#include "alignment/sensor_error.hpp"

#include <octosurf/alignment.hpp>

/// Eigen's decompositions of a pose's and a sensor's covariances. Compiled in one file: each takes seconds
/// wherever it is instantiated.
namespace octosurf::alignment {

/// Solves A x = b for a symmetric positive definite A (LDLᵀ).
Twist solve(const TwistCovariance& A, const Twist& b);
/// The inverse of a symmetric positive definite matrix, by the same.
TwistCovariance inverse_of_definite(const TwistCovariance& A);
/// By LU.
TwistCovariance inverse(const TwistCovariance& A);
SensorErrorCovariance inverse(const SensorErrorCovariance& A);

struct PrincipalAxes {
  Twist values;             ///< descending
  TwistCovariance vectors;  ///< columns, in their order
};
PrincipalAxes principal_axes(const TwistCovariance& A);

}  // namespace octosurf::alignment
