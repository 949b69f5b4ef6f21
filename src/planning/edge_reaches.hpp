#pragma once

#include "planning/convex_lines.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace octosurf::planning {

/// A line and how far its ends lie along a kernel's normals.
struct LineExtent {
  Eigen::Vector2d from, to;
  /// By the kernel's sides, rounded up to fours: of `from`, of `to`, and the lesser of the two; what is
  /// beyond the last side says nothing.
  std::vector<double> along;

  const double* from_along() const { return along.data(); }
  const double* to_along() const { return along.data() + along.size() / 3; }
  const double* low() const { return along.data() + along.size() / 3 * 2; }
};

/// What each edge of a polygon reaches with a convex kernel, {p + q: p on the edge, q in the kernel}: eight
/// edges at once are tested against a line. A reach has as many sides as the kernel, then the edge's front,
/// moved by the kernel's corner farthest to its right, and its back.
class EdgeReaches {
 public:
  static constexpr std::uint32_t at_once = 8;

  /// Room for eights of edges.
  void assign(const ConvexLines& kernel, std::size_t eights);
  /// A chain of up to eight edges, from corner to corner. Returns the kernel's corner that is farthest to the
  /// right of each.
  std::array<std::uint32_t, at_once> set(std::uint32_t eight, std::span<const Eigen::Vector2d> corners);

  /// Makes `line` that from one point to the other.
  void measure(const Eigen::Vector2d& from, const Eigen::Vector2d& to, LineExtent& line) const;

  /// Which of the eight edges reach into the line's box by all of a reach's sides, a bit for each: the others
  /// cover nothing of it.
  std::uint32_t near(std::uint32_t eight, const LineExtent& line) const;
  /// What of the line an edge's reach covers; sides as numbered above. False if nothing.
  bool cut(std::uint32_t edge, const LineExtent& line, Cut& cut) const;

 private:
  ConvexLines kernel_;
  std::size_t sides_ = 0;
  std::vector<double> normals_;  // the kernel's: all u, then all v, each rounded up to fours
  // Of each eight of edges rows of eight: one for each side of the kernel, how far along its normal the
  // reaches go; the fronts' and the backs' offsets along the edges' right; these directions' u and v.
  std::vector<double> rows_;
};

}  // namespace octosurf::planning
