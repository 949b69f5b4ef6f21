#pragma once

#include "planning/convex_lines.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace octosurf::planning {

/// A line and the positions of its ends along a kernel's normals.
struct LineExtent {
  Eigen::Vector2d from, to;
  /// By the kernel's sides, rounded up to fours: of `from`, of `to`, and their minimum; entries beyond the
  /// last side are unused.
  std::vector<double> along;

  const double* from_along() const { return along.data(); }
  const double* to_along() const { return along.data() + along.size() / 3; }
  const double* low() const { return along.data() + along.size() / 3 * 2; }
};

/// The reach of each polygon edge with a convex kernel, {p + q: p on the edge, q in the kernel}: eight edges
/// at once are tested against a line. A reach has the kernel's sides, then the edge's front, moved by the
/// kernel's corner farthest to its right, and its back.
class EdgeReaches {
 public:
  static constexpr std::uint32_t at_once = 8;

  /// Allocates `eights` groups of eight edges.
  void assign(const ConvexLines& kernel, std::size_t eights);
  /// Sets a chain of up to eight edges, from corner to corner. Returns the kernel's corner farthest to the
  /// right of each.
  std::array<std::uint32_t, at_once> set(std::uint32_t eight, std::span<const Eigen::Vector2d> corners);

  /// Sets `line` from one point to the other.
  void measure(const Eigen::Vector2d& from, const Eigen::Vector2d& to, LineExtent& line) const;

  /// A bit for each of the eight edges whose reach meets the line's box by the tests of all sides: the others
  /// cover nothing of it.
  std::uint32_t near(std::uint32_t eight, const LineExtent& line) const;
  /// The part of the line covered by an edge's reach; sides are numbered as above. False if none.
  bool cut(std::uint32_t edge, const LineExtent& line, Cut& cut) const;

 private:
  ConvexLines kernel_;
  std::size_t sides_ = 0;
  std::vector<double> normals_;  // the kernel's: all u, then all v, each rounded up to fours
  // For each eight of edges rows of eight: for each side of the kernel the reaches' extent along its normal;
  // the fronts' and the backs' offsets along the edges' right; these directions' u and v.
  std::vector<double> rows_;
};

}  // namespace octosurf::planning
