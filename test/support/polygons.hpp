#pragma once

#include <memory>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::test {

// What Boost.Geometry says of polygons. It stands in polygons.cpp alone: its headers and what they
// instantiate cost every file that includes them some ten seconds.

/// Empty if every polygon is valid by the OGC rules (orientation included), else what is wrong.
std::string invalid(const std::vector<Polygon>& polygons);

double area(const Polygon& polygon);
double area(const std::vector<Polygon>& polygons);
double perimeter(const std::vector<Polygon>& polygons);  ///< of outer rings and holes

/// They share more than parts of their rings, and neither holds the other.
bool overlap(const Polygon& a, const Polygon& b);

/// In one polygons, not in the other, m².
double difference(const std::vector<Polygon>& a, const std::vector<Polygon>& b);

/// What both hold: its area, m², and its centroid, if there is any.
struct Common {
  double area = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
};
Common intersection(const std::vector<Polygon>& a, const std::vector<Polygon>& b);

/// Polygons that are asked about many points.
class Region {
 public:
  explicit Region(const std::vector<Polygon>& polygons);
  bool covers(const Eigen::Vector2d& p) const;  ///< in a polygon or on its rings

 private:
  struct Polygons;
  std::shared_ptr<const Polygons> polygons_;
};

/// Outer and inner ones together.
std::size_t count_vertices(const std::vector<Polygon>& polygons);

/// Distance from a point to the nearest ring.
double distance_to_rings(const Eigen::Vector2d& p, const std::vector<Polygon>& polygons);

}  // namespace octosurf::test
