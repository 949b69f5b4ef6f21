#pragma once

#include <Eigen/Core>
#include <cstddef>

#include <octosurf/surface.hpp>

namespace octosurf::geometry {

// The even-odd rule: a point is inside rings if a ray from it crosses them an odd number of times.

/// Whether the edge from `a` to `b` crosses the line y = v. Half open, so that a vertex on the line counts
/// once where the ring passes through it.
inline bool crosses(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double v) {
  return (a.y() <= v) != (b.y() <= v);
}
/// x of the crossing.
inline double crossing(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double v) {
  return a.x() + (v - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
}
/// Whether the edge from `a` to `b` crosses the ray from `p` toward −x.
inline bool passes_left_of(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return crosses(a, b, p.y()) && crossing(a, b, p.y()) < p.x();
}
inline bool inside(const Ring2& ring, const Eigen::Vector2d& p) {
  bool odd = false;
  for (std::size_t i = 0; i < ring.size(); ++i)
    odd ^= passes_left_of(p, ring[i], ring[i + 1 < ring.size() ? i + 1 : 0]);
  return odd;
}

}  // namespace octosurf::geometry
