#include "planning/convex_sides.hpp"

#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
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

ConvexSides::ConvexSides(const Ring2& ring) : ring_(ring), area_(area_of(ring)) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    box_.extend(ring[i]);
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

ConvexSides::Line ConvexSides::lowest_at(const Eigen::Vector2d& from, const Eigen::Vector2d& along,
                                         double t) const {
  Line lowest;
  double least = std::numeric_limits<double>::infinity();
  for (const Side& side : sides_) {
    const Line line{side.offset - side.normal.dot(from), -side.normal.dot(along)};
    const double height = line.value + line.slope * t;
    if (height < least) {
      least = height;
      lowest = line;
    }
  }
  return lowest;
}

// The minimum over the sides' lines is concave along the segment: from both its ends, rising and falling
// lines are followed to the top, until no other lies below their intersection.
double ConvexSides::depth(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  const Eigen::Vector2d along = to - from;
  Line rising = lowest_at(from, along, 0), falling = lowest_at(from, along, 1);
  if (rising.slope <= 0) return rising.value;
  if (falling.slope >= 0) return falling.value + falling.slope;
  for (std::size_t step = 0;; ++step) {
    const double t = (falling.value - rising.value) / (rising.slope - falling.slope);
    const double top = rising.value + rising.slope * t;
    const Line lowest = lowest_at(from, along, t);
    const double height = lowest.value + lowest.slope * t;
    // Each step permanently removes a side; the count protects against rounding.
    if (height >= top || step > sides_.size()) return height;
    (lowest.slope > 0 ? rising : falling) = lowest;
  }
}

double ConvexSides::distance(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
  if (depth(from, to) >= 0) return 0;
  // Disjoint: nearest at a vertex of one or an end of the other.
  double best2 = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ring_.size(); ++i) {
    const Eigen::Vector2d &a = ring_[i], &b = ring_[(i + 1) % ring_.size()];
    best2 = std::min({best2, (closest_on_segment(from, to, a) - a).squaredNorm(),
                      (closest_on_segment(a, b, from) - from).squaredNorm(),
                      (closest_on_segment(a, b, to) - to).squaredNorm()});
  }
  return std::sqrt(best2);
}

// One bit for each side of the box that a point lies beyond.
unsigned ConvexSides::beyond(const Eigen::Vector2d& p) const {
  return (p.x() < box_.min().x() ? 1u : 0u) | (p.x() > box_.max().x() ? 2u : 0u) |
         (p.y() < box_.min().y() ? 4u : 0u) | (p.y() > box_.max().y() ? 8u : 0u);
}

double ConvexSides::area_within(const Ring2& ring) const {
  // A chain beyond one side of the box encloses no part of it and is replaced by its ends.
  Ring2 kept;
  unsigned chain = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const unsigned here = beyond(ring[i]);
    const unsigned common = chain & here & beyond(ring[(i + 1) % ring.size()]);
    if (common != 0) {
      chain = common;
      continue;
    }
    kept.push_back(ring[i]);
    chain = here;
  }
  // Sutherland and Hodgman. A concave shape falls into parts joined along the sides, which have no area.
  for (const Side& side : sides_) {
    Ring2 inside;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const Eigen::Vector2d &p = kept[i], &q = kept[(i + 1) % kept.size()];
      const double hp = side.offset - side.normal.dot(p), hq = side.offset - side.normal.dot(q);
      if (hp >= 0) inside.push_back(p);
      if ((hp > 0 && hq < 0) || (hp < 0 && hq > 0)) inside.push_back(p + hp / (hp - hq) * (q - p));
    }
    kept = std::move(inside);
  }
  return area_of(kept);
}

}  // namespace octosurf::planning
