#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::evaluation {

/// Polygons of one plane, made ready for very many point queries.
///
/// A point is inside if a ray from it crosses the rings an odd number of times, so outer rings,
/// holes and islands need not be told apart. Edges are sorted into rows of equal height; a query
/// looks at the edges of its row only. Build O(edges · rows they span), query O(edges of a row).
class PlanarRegion {
 public:
  explicit PlanarRegion(const std::vector<Polygon>& polygons);

  bool empty() const { return edges_.empty(); }
  const Eigen::AlignedBox2d& box() const { return box_; }

  bool contains(const Eigen::Vector2d& uv) const;
  /// Inside, or at most `margin` (m) away from a ring.
  bool within(const Eigen::Vector2d& uv, double margin) const;
  /// Distance (m) to the nearest ring; infinite if it is more than `at_most`.
  double ring_distance(const Eigen::Vector2d& uv,
                       double at_most = std::numeric_limits<double>::infinity()) const;

  /// Calls visit(uv) for every centre of a grid of `step` (m), laid through the origin of (u, v),
  /// that is inside; by rows.
  template <class Visit>
  void for_each_cell(double step, Visit&& visit) const {
    if (empty()) return;
    std::vector<double> crossings;
    const double last = std::floor(box_.max().y() / step);
    for (double row = std::floor(box_.min().y() / step); row <= last; ++row) {
      const double v = (row + 0.5) * step;
      crossings_at(v, crossings);
      for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
        for (double column = std::ceil(crossings[i] / step - 0.5); (column + 0.5) * step < crossings[i + 1];
             ++column) {
          visit(Eigen::Vector2d((column + 0.5) * step, v));
        }
      }
    }
  }

 private:
  struct Edge {
    Eigen::Vector2d a, b;
  };

  void crossings_at(double v, std::vector<double>& u) const;  // ascending
  std::size_t row_of(double v) const;                         // clamped to the rows there are

  std::vector<Edge> edges_;
  Eigen::AlignedBox2d box_;
  double row_height_ = 1;
  std::vector<std::size_t> row_begin_;  // rows + 1 positions in row_edges_
  std::vector<std::uint32_t> row_edges_;
};

/// Calls visit(uv) along every ring at equal distances of at most `step` (m) within an edge.
template <class Visit>
void for_each_on_ring(const Ring2& ring, double step, Visit&& visit) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d& a = ring[i];
    const Eigen::Vector2d edge = ring[(i + 1) % ring.size()] - a;
    const double pieces = std::ceil(edge.norm() / step);
    for (double k = 0; k < pieces; ++k) visit(Eigen::Vector2d(a + edge * ((k + 0.5) / pieces)));
  }
}

/// m², whichever way round its rings run.
double enclosed_area(const Polygon& polygon);

}  // namespace octosurf::evaluation
