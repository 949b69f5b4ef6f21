#pragma once

#include "geometry/moments.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <span>

namespace octosurf::geometry {

/// The normal matrix of a least-squares plane over a given frame, off = offset + slopes·(u, v), from moments
/// about the frame's origin. `R`: rows u, v, normal of the frame.
inline Eigen::Matrix3d normal_matrix(const Moments& about, const Eigen::Matrix3d& R) {
  const Eigen::Vector3d sum = R * about.sum;
  const Eigen::Matrix3d outer = R * about.outer * R.transpose();
  Eigen::Matrix3d normal;
  normal << about.count, sum.x(), sum.y(),  //
      sum.x(), outer(0, 0), outer(0, 1),    //
      sum.y(), outer(0, 1), outer(1, 1);
  return normal;
}

/// That plane: offset, slope along u, slope along v.
inline Eigen::Vector3d plane_over(const Moments& about, const Eigen::Matrix3d& R) {
  const Eigen::Vector3d sum = R * about.sum;
  const Eigen::Matrix3d outer = R * about.outer * R.transpose();
  Eigen::Matrix3d normal = normal_matrix(about, R);
  // For a few points, or collinear ones, a slope of 1 is no constraint in practice; it keeps this regular.
  normal.diagonal().tail<2>().array() += 1e-9 * about.count;
  return normal.ldlt().solve(Eigen::Vector3d(sum.z(), outer(0, 2), outer(1, 2)));
}

/// Readings with consistent relative weights.
struct ReadingGroup {
  Moments about;  ///< the frame's origin, weighted by 1/σ² up to a common factor
  double readings = 0;
};

/// Covariance of plane_over() of all groups together; symmetric positive definite up to rounding. The common
/// factor of the variances is estimated from the residuals, for each group by itself: points of a first scan
/// and means of later ones have weights of different origin. Collinear points have a prior deviation of 1 for
/// the slope across; points have a deviation of at least 0.1 mm, the precision of their storage.
inline Eigen::Matrix3d covariance_over(std::span<const ReadingGroup> groups, const Eigen::Matrix3d& R) {
  Moments all, scattered;  // N, and Σ of the groups' N times their variances of unit weight
  double readings = 0;
  for (const ReadingGroup& group : groups) {
    all.add(group.about);
    readings += group.readings;
  }
  const Eigen::Vector3d plane = plane_over(all, R);
  const Eigen::Vector3d along = R.transpose() * Eigen::Vector3d(-plane[1], -plane[2], 1);
  const double spent = readings / std::max(1.0, readings - 3);
  double left = 0;
  for (const ReadingGroup& group : groups) {
    if (!(group.about.count > 0)) continue;
    const double of_group = group.about.count * group.about.mean_squared_distance(along, plane[0]);
    left += of_group;
    scattered.add(group.about, spent * of_group / std::max(1.0, group.readings) + 1e-8);
  }
  const double variance = left / std::max(1.0, readings - 3) + 1e-8;
  Eigen::Matrix3d normal = normal_matrix(all, R), between = normal_matrix(scattered, R);
  normal.diagonal().tail<2>().array() += variance;  // a slope of 1, as in plane_over()
  between.diagonal().tail<2>().array() += variance * variance;
  const Eigen::Matrix3d inverse = normal.inverse();
  return inverse * between * inverse;
}

}  // namespace octosurf::geometry
