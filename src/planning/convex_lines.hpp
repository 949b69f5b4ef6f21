#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// No side, line or edge.
inline constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Perpendicular to `v`, to its right, of the same length.
inline Eigen::Vector2d right_of(const Eigen::Vector2d& v) { return {v.y(), -v.x()}; }

/// A counter-clockwise convex polygon as lines n·x ≤ c, one for each side, side k from corner k; normals as
/// long as the sides.
struct ConvexLines {
  ConvexLines() = default;
  explicit ConvexLines(const Ring2& ring);

  /// The corners farthest to the right and to the left of a direction. O(corners), without data-dependent
  /// branches.
  std::pair<std::size_t, std::size_t> farthest_beside(const Eigen::Vector2d& along) const {
    const double turn = turn_of(along);
    return {farthest_at(turn), farthest_at(turn > 0 ? turn - 2 : turn + 2)};
  }

  Ring2 corners;
  std::vector<Eigen::Vector2d> normals;
  std::vector<double> offsets;
  Eigen::AlignedBox2d box;

 private:
  /// A monotone function of the direction's angle, from −2 to 2; half a turn adds 2.
  static double turn_of(const Eigen::Vector2d& v) {
    return std::copysign(1 - v.x() / (std::abs(v.x()) + std::abs(v.y())), v.y());
  }
  /// By binary search in the sides' directions.
  std::size_t farthest_at(double turn) const {
    std::size_t at = first_;
    for (const double side : turns_) at += side <= turn ? 1 : 0;
    return at < turns_.size() ? at : at - turns_.size();
  }

  std::vector<double> turns_;  // of the sides' directions, ascending, from side first_
  std::size_t first_ = 0;
};

/// The part of a line a + t·(b − a), t in (0, 1), inside something convex, and the sides by which it enters
/// and leaves; none if that is at its own end.
struct Cut {
  double in = 0, out = 1;
  std::uint32_t in_side = none, out_side = none;

  /// Cuts by a side, given the signed distances of the line's ends inside it. False if nothing is left.
  bool by(double at_a, double at_b, std::uint32_t side) {
    if (at_a <= 0 && at_b <= 0) return false;
    if (at_a < 0) {
      const double t = at_a / (at_a - at_b);
      if (t > in) {
        in = t;
        in_side = side;
      }
    } else if (at_b < 0) {
      const double t = at_a / (at_a - at_b);
      if (t < out) {
        out = t;
        out_side = side;
      }
    }
    return in < out;
  }
};

/// Up to half a µm in u and in v, pseudo-random, but always the same for the same two points.
Eigen::Vector2d jitter_of(const Eigen::Vector2d& p, const Eigen::Vector2d& q);

}  // namespace octosurf::planning
