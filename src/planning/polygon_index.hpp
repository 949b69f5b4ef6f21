#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Spatial index of a surface's polygons for point queries, equivalent to the full scans of rings.hpp. Built
/// in O(n log n), about 0.3 µs an edge.
class PolygonIndex {
 public:
  explicit PolygonIndex(const std::vector<Polygon>& polygons);
  PolygonIndex(PolygonIndex&&) noexcept;
  ~PolygonIndex();

  /// Even-odd rule over all rings, with the result of contains() of each polygon on edges. O(edges in its
  /// row).
  bool contains(const Eigen::Vector2d& point) const;
  /// The nearest point of the polygons: the point itself if it lies in them. Empty without polygons.
  std::optional<Eigen::Vector2d> closest(const Eigen::Vector2d& point) const;
  /// Calls `visit(from, to)` for the edges that may meet the box, until it returns false.
  void for_each_edge_near(
      const Eigen::AlignedBox2d& box,
      const std::function<bool(const Eigen::Vector2d&, const Eigen::Vector2d&)>& visit) const;

  const Eigen::AlignedBox2d& box() const { return box_; }
  bool empty() const { return edges_.empty(); }

 private:
  struct Tree;  // spatial, of the edges
  using Edge = std::pair<Eigen::Vector2d, Eigen::Vector2d>;
  std::size_t row_of(double v) const;
  void sort_into_rows();

  std::vector<Edge> edges_;
  Eigen::AlignedBox2d box_;
  double rows_per_metre_ = 0;
  std::vector<std::uint32_t> row_begin_,
      rows_;  // edges of row r: rows_[row_begin_[r]] … rows_[row_begin_[r + 1]]
  std::unique_ptr<const Tree> tree_;
};

}  // namespace octosurf::planning
