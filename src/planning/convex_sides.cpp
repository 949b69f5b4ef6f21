#include "planning/convex_sides.hpp"

#include <algorithm>
#include <limits>

namespace octosurf::planning {

double area_of(const Ring2& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

double area_of(const std::vector<Polygon>& polygons) {
  double sum = 0;
  for (const Polygon& polygon : polygons) {
    sum += area_of(polygon.outer);
    for (const Ring2& hole : polygon.holes) sum += area_of(hole);
  }
  return sum;
}

ConvexSides::ConvexSides(const Ring2& ring) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d along = ring[(i + 1) % ring.size()] - ring[i];
    if (along.squaredNorm() == 0) continue;
    const Eigen::Vector2d normal = Eigen::Vector2d(along.y(), -along.x()).normalized();
    sides_.push_back({normal, normal.dot(ring[i])});
  }
  if (!sides_.empty()) return;  // otherwise a point, which contains only itself
  sides_ = {{Eigen::Vector2d::UnitX(), ring[0].x()}, {-Eigen::Vector2d::UnitX(), -ring[0].x()}};
  for (const double sign : {1.0, -1.0}) sides_.push_back({{0, sign}, sign * ring[0].y()});
}

double ConvexSides::depth(const Eigen::Vector2d& point) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Side& side : sides_) least = std::min(least, side.offset - side.normal.dot(point));
  return least;
}

}  // namespace octosurf::planning
