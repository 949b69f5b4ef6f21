#pragma once

#include <Eigen/Core>

namespace octosurf::geometry {

/// Side of c as seen along a → b: left 1, on the line 0, right -1. Exact (CGAL's filtered predicate).
int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

}  // namespace octosurf::geometry
