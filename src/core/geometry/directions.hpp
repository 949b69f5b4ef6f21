#pragma once

#include <Eigen/Geometry>

namespace octosurf::geometry {

/// Throws Error(usage) naming `where` unless `direction` is finite and longer than 1e-9.
void require_direction(const Eigen::Vector3d& direction, const char* where);

/// On a straight line and by slerp: `t` from 0 (a) to 1 (b), or beyond, where the motion goes on.
inline Eigen::Isometry3d pose_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double t) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = (1 - t) * a.translation() + t * b.translation();
  T.linear() = Eigen::Quaterniond(a.linear()).slerp(t, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  return T;
}

}  // namespace octosurf::geometry
