#pragma once

#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::reference {

/// The paper's Algorithm 3 up to the polygon: Delaunay triangulation, triangles with a side over
/// `max_side` dropped, edges with exactly one triangle chained into rings.
struct AlphaShape {
  std::vector<Polygon> polygons;        ///< one per edge-connected piece; rings are simple
  std::vector<std::uint32_t> boundary;  ///< indices of the rings' vertices, ascending, each once
  double area_m2 = 0;
};

/// `points` in the surface's plane, m. Duplicates and collinear points are allowed (the latter span
/// nothing). Cost O(n log n).
AlphaShape alpha_shape(const std::vector<Eigen::Vector2d>& points, double max_side);

/// Signed area, positive for counter-clockwise rings.
double signed_area(const Ring2& ring);

/// Point in polygon by the paper's rule: inside an odd number of all rings (section IV-A). Edges are
/// bucketed by v, so that a test looks at the edges of one row only.
class OddEven {
 public:
  OddEven() = default;
  OddEven(const std::vector<Polygon>& polygons, double row_height);
  bool contains(const Eigen::Vector2d& point) const;

 private:
  struct Edge {
    Eigen::Vector2d from, to;
  };
  double lowest_ = 0;
  double row_height_ = 1;
  std::vector<std::vector<Edge>> rows_;
};

}  // namespace octosurf::reference
