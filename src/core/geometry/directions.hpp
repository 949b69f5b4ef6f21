#pragma once

#include <Eigen/Geometry>

#include <octosurf/error.hpp>

namespace octosurf::geometry {

/// Throws Error(usage) naming `where` unless `direction` is finite and longer than 1e-9.
inline void require_direction(const Eigen::Vector3d& direction, const char* where) {
  if (direction.allFinite() && direction.norm() > 1e-9) return;
  throw Error(Error::Kind::usage, where, "is no direction", "give a vector that is finite and not zero");
}

/// On a straight line and by slerp: `t` from 0 (a) to 1 (b), or beyond, where the motion goes on.
inline Eigen::Isometry3d pose_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double t) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = (1 - t) * a.translation() + t * b.translation();
  T.linear() = Eigen::Quaterniond(a.linear()).slerp(t, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  return T;
}

}  // namespace octosurf::geometry
