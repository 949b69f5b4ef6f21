#pragma once

#include "planning/rings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A surface's polygons by rows for point queries, equivalent to the full scans of rings.hpp. Built in O(n).
class PolygonIndex {
 public:
  explicit PolygonIndex(const std::vector<Polygon>& polygons);

  /// Even-odd rule over all rings, with the result of contains() of each polygon on edges. O(edges in its
  /// row).
  bool contains(const Eigen::Vector2d& point) const;
  /// The nearest point of the polygons, if it is at most so far off: the point itself if it lies in them.
  /// O(edges in the rows between).
  std::optional<Eigen::Vector2d> closest(const Eigen::Vector2d& point, double within) const;
  /// Calls `visit(from, to)` for the edges that may meet the box, for some of them several times.
  template <class Visit>
  void for_each_edge_near(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    if (edges_.empty()) return;
    for (std::uint32_t k = row_begin_[row_of(box.min().y())]; k < row_begin_[row_of(box.max().y()) + 1];
         ++k) {
      const auto& [a, b] = edges_[rows_[k]];
      if (Eigen::AlignedBox2d(a.cwiseMin(b), a.cwiseMax(b)).intersects(box)) visit(a, b);
    }
  }

  const Eigen::AlignedBox2d& box() const { return box_; }

 private:
  std::size_t row_of(double v) const {
    const double row = (v - box_.min().y()) * rows_per_metre_;
    return static_cast<std::size_t>(std::clamp(row, 0.0, static_cast<double>(row_begin_.size() - 2)));
  }
  void sort_into_rows();

  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> edges_;
  Eigen::AlignedBox2d box_;
  double rows_per_metre_ = 0;
  std::vector<std::uint32_t> row_begin_,
      rows_;  // edges of row r: rows_[row_begin_[r]] … rows_[row_begin_[r + 1]]
};

}  // namespace octosurf::planning
