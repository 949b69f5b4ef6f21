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

/// No side, no line, no edge.
inline constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// At right angles to `v`, to its right, as long.
inline Eigen::Vector2d right_of(const Eigen::Vector2d& v) { return {v.y(), -v.x()}; }

/// A counter-clockwise convex polygon as lines n·x ≤ c, one for each side, side k from corner k; normals as
/// long as the sides.
struct ConvexLines {
  ConvexLines() = default;
  explicit ConvexLines(const Ring2& ring);

  /// The corners farthest to the right and to the left of a direction. O(corners), without a branch that
  /// depends on it.
  std::pair<std::size_t, std::size_t> farthest_beside(const Eigen::Vector2d& along) const {
    const double turn = turn_of(along);
    return {farthest_at(turn), farthest_at(turn > 0 ? turn - 2 : turn + 2)};
  }

  Ring2 corners;
  std::vector<Eigen::Vector2d> normals;
  std::vector<double> offsets;
  Eigen::AlignedBox2d box;

 private:
  /// Grows with the direction's angle, from −2 to 2; by 2 for half a turn.
  static double turn_of(const Eigen::Vector2d& v) {
    return std::copysign(1 - v.x() / (std::abs(v.x()) + std::abs(v.y())), v.y());
  }
  /// Where the sides' own directions pass it.
  std::size_t farthest_at(double turn) const {
    std::size_t at = first_;
    for (const double side : turns_) at += side <= turn ? 1 : 0;
    return at < turns_.size() ? at : at - turns_.size();
  }

  std::vector<double> turns_;  // of the sides' directions, ascending, from side first_
  std::size_t first_ = 0;
};

/// What of a line a + t·(b − a), t in (0, 1), is inside something convex, and by which of its sides it comes
/// in and goes out; none where it does so at its end.
struct Cut {
  double in = 0, out = 1;
  std::uint32_t in_side = none, out_side = none;

  /// By the side of which the line's ends are so far inside. False if nothing is left.
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

/// Up to half a µm in u and in v, by chance, but always the same for the same two points.
Eigen::Vector2d jitter_of(const Eigen::Vector2d& p, const Eigen::Vector2d& q);

}  // namespace octosurf::planning
