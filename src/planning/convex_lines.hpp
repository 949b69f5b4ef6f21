#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>
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
  explicit ConvexLines(const Ring2& ring);

  /// The corner farthest to the right of a direction. O(log corners).
  std::size_t farthest_right_of(const Eigen::Vector2d& along) const;

  Ring2 corners;
  std::vector<Eigen::Vector2d> normals;
  std::vector<double> offsets;
  Eigen::AlignedBox2d box;

 private:
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
