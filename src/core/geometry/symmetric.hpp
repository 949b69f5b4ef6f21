#pragma once

#include <Eigen/Geometry>

/// Of Eigen, what takes seconds to compile wherever it is instantiated.
namespace octosurf::geometry {

struct PrincipalAxes2 {
  Eigen::Vector2d values;   ///< ascending
  Eigen::Matrix2d vectors;  ///< columns, in their order
};
PrincipalAxes2 principal_axes(const Eigen::Matrix2d& symmetric);

struct PrincipalAxes3 {
  Eigen::Vector3d values;   ///< ascending
  Eigen::Matrix3d vectors;  ///< columns, in their order
};
PrincipalAxes3 principal_axes(const Eigen::Matrix3d& symmetric);

/// The smallest rotation that takes one direction to the other.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace octosurf::geometry
