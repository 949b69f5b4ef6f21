#pragma once

#include "planning/convex_lines.hpp"
#include "planning/edge_reaches.hpp"

#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The edges of a polygon, their reaches with a kernel, and the candidate boundary lines of the inset: each
/// edge moved by the kernel's farthest corner, and the kernel's sides at convex corners; then the sides of
/// other obstacles.
///
/// Edges are numbered along their rings, each ring starting a new eight; the numbers between are unused.
/// Lines are numbered in the order of their edges.
class InsetLines {
 public:
  InsetLines() = default;
  InsetLines(const InsetLines&) = delete;
  InsetLines& operator=(const InsetLines&) = delete;

  void assign(const Polygon& polygon, const Ring2& kernel, std::span<const Ring2> besides);

  struct Line {
    Eigen::Vector2d from, to;
    std::uint32_t number = none;
    std::uint32_t next = none;  ///< the line that continues at its end, if any
  };
  /// Consecutive edges.
  struct Eight {
    std::uint32_t edges = 0;
    Eigen::AlignedBox2d box;
  };

  const ConvexLines& kernel() const { return kernel_; }
  const EdgeReaches& reaches() const { return reaches_; }
  const std::vector<Eight>& eights() const { return eights_; }
  const std::vector<ConvexLines>& besides() const { return besides_; }
  const Eigen::AlignedBox2d& box() const { return box_; }
  std::uint32_t line_count() const { return line_count_; }

  // Edge i goes from corner i to corner next(i); the polygon's outside lies to its left.
  const Eigen::Vector2d& corner(std::uint32_t edge) const { return corners_[edge]; }
  std::uint32_t next(std::uint32_t edge) const { return around_[edge].next; }
  std::uint32_t previous(std::uint32_t edge) const { return around_[edge].previous; }

  /// An edge's lines: the 0th is its front, then sides() of the kernel's sides about its end; the next edge's
  /// front continues there if they are joined.
  Line line(std::uint32_t edge, std::uint32_t nth) const;
  std::uint32_t sides(std::uint32_t edge) const { return around_[edge].sides; }
  bool joined(std::uint32_t edge) const { return around_[edge].joined; }

  Line beside_line(std::uint32_t beside, std::uint32_t side) const;

  /// The line that bounds an edge's reach on that side (EdgeReaches); none or open as in Rest.
  std::uint32_t line_of_side(std::uint32_t edge, std::uint32_t side) const;

 private:
  struct Around {
    std::uint32_t next = 0, previous = 0;
    std::uint32_t farthest = 0;  // of the kernel's corners, to the edge's right
    std::uint32_t front_line = 0;
    std::uint32_t sides = 0;
    bool joined = false;
  };

  void add_ring(const Ring2& ring);
  void add_reaches();
  void count_lines();
  void add_besides(std::span<const Ring2> besides);
  /// Corner index modulo the kernel's corners.
  std::uint32_t round(std::uint32_t corner) const {
    const auto m = static_cast<std::uint32_t>(kernel_.corners.size());
    return corner < m ? corner : corner - m;
  }

  ConvexLines kernel_;
  EdgeReaches reaches_;
  Ring2 corners_;
  std::vector<Around> around_;
  std::vector<Eight> eights_;
  std::vector<ConvexLines> besides_;
  std::vector<std::uint32_t> first_beside_line_;
  std::uint32_t line_count_ = 0;
  Eigen::AlignedBox2d box_;
};

/// A line is cut here by something that cannot be a boundary.
inline constexpr std::uint32_t open = none - 1;

/// An uncovered part of a line, and the lines that cut it at its ends; none at the line's own end, or open.
struct Rest {
  Eigen::Vector2d start;
  std::uint32_t line = 0;
  std::uint32_t from_by = none, to_by = none;
  std::uint32_t next = none;  ///< the line that continues where the line itself ends
};

}  // namespace octosurf::planning
