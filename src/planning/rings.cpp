#include "planning/rings.hpp"

#include "geometry/even_odd.hpp"

#include <algorithm>

namespace octosurf::planning {

namespace {

void add_crossings(const Polygon& polygon, double v, std::vector<double>& all) {
  for_each_edge(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    if (geometry::crosses(a, b, v)) all.push_back(geometry::crossing(a, b, v));
  });
}

}  // namespace

std::vector<double> crossings(const Polygon& polygon, double v) {
  std::vector<double> result;
  add_crossings(polygon, v, result);
  std::sort(result.begin(), result.end());
  return result;
}

std::vector<double> crossings(const std::vector<Polygon>& polygons, double v) {
  std::vector<double> result;
  for (const Polygon& polygon : polygons) add_crossings(polygon, v, result);
  std::sort(result.begin(), result.end());
  return result;
}

bool contains(const Polygon& polygon, const Eigen::Vector2d& point) {
  const std::vector<double> at = crossings(polygon, point.y());
  return (std::lower_bound(at.begin(), at.end(), point.x()) - at.begin()) % 2 == 1;
}

Eigen::Vector2d closest_on_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                   const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = to - from;
  const double length2 = along.squaredNorm();
  if (length2 <= 0) return from;
  return from + std::clamp(along.dot(point - from) / length2, 0.0, 1.0) * along;
}

}  // namespace octosurf::planning
