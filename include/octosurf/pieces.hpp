#pragma once

#include <Eigen/Core>
#include <vector>

namespace octosurf {

/// A convex part of a surface.
struct ConvexPiece {
  std::vector<Eigen::Vector3d> vertices;  ///< map frame, counter-clockwise seen from the normal's tip
  /// The same part as A·(u, v) ≤ b in the surface's frame; rows of unit length, one per edge.
  Eigen::Matrix<double, Eigen::Dynamic, 2> A;
  Eigen::VectorXd b;  ///< see A; m
};

}  // namespace octosurf
