#include "planning/rings.hpp"

#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace octosurf::planning {

namespace {

void divide(Ring2& ring, double longest_edge) {
  Ring2 divided;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d a = ring[i], along = ring[(i + 1) % ring.size()] - a;
    const int steps = std::max(1, static_cast<int>(std::ceil(along.norm() / longest_edge - 1e-9)));
    for (int k = 0; k < steps; ++k) divided.push_back(a + along * k / steps);
  }
  ring = std::move(divided);
}

}  // namespace

bool contains(const Polygon& polygon, const Eigen::Vector2d& point) {
  bool odd = geometry::inside(polygon.outer, point);
  for (const Ring2& hole : polygon.holes) odd ^= geometry::inside(hole, point);
  return odd;
}

Eigen::Vector2d closest_on_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                   const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = to - from;
  const double length2 = along.squaredNorm();
  if (length2 <= 0) return from;
  return from + std::clamp(along.dot(point - from) / length2, 0.0, 1.0) * along;
}

std::vector<Polygon> clipped(const std::vector<Polygon>& polygons, const Eigen::AlignedBox2d& box) {
  std::vector<Polygon> parts = polygons;
  const auto is_gone = [](const Ring2& ring) { return ring.size() < 3; };
  for_each_ring(parts, [&](Ring2& ring) {
    for (const Eigen::Index axis : {0, 1}) {
      ring = cut(ring, [&](const Eigen::Vector2d& p) { return p[axis] - box.max()[axis]; });
      ring = cut(ring, [&](const Eigen::Vector2d& p) { return box.min()[axis] - p[axis]; });
    }
  });
  std::erase_if(parts, [&](const Polygon& part) { return is_gone(part.outer); });
  for (Polygon& part : parts) std::erase_if(part.holes, is_gone);
  return parts;
}

double depth_in(const Ring2& convex, const Eigen::Vector2d& point) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < convex.size(); ++i) {
    const Eigen::Vector2d from = convex[i], along = convex[(i + 1) % convex.size()] - from;
    if (along.squaredNorm() > 0) least = std::min(least, cross(along, point - from) / along.norm());
  }
  return std::isfinite(least) ? least : -(point - convex[0]).norm();
}

double area_of(const std::vector<Polygon>& polygons) {
  double sum = 0;
  for (const Polygon& polygon : polygons) sum += geometry::area_of(polygon);
  return sum;
}

Eigen::AlignedBox2d box_of(const Surface& surface) {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : surface.polygons) box.extend(box_of(polygon.outer));
  return box;
}

Eigen::AlignedBox3d box_of(const Surface& surface, const Eigen::Isometry3d& T) {
  Eigen::AlignedBox3d box;
  for (const Polygon& polygon : surface.polygons)
    for (const Eigen::Vector2d& p : polygon.outer) box.extend(T * Eigen::Vector3d(p.x(), p.y(), 0));
  return box;
}

bool same_outline(const Surface& a, const Surface& b) {
  const auto same = [](const Polygon& one, const Polygon& other) {
    return one.outer == other.outer && one.holes == other.holes;
  };
  return &a == &b || (a.T_map_surface.matrix() == b.T_map_surface.matrix() &&
                      std::ranges::equal(a.polygons, b.polygons, same));
}

SurfacePtr with_outline(const Surface& surface, std::vector<Polygon> polygons) {
  double longest_edge = 0;
  for_each_edge(surface.polygons, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    longest_edge = std::max(longest_edge, (b - a).norm());
  });
  auto result = std::make_shared<Surface>(surface);
  for_each_ring(polygons, [&](Ring2& ring) { divide(ring, longest_edge); });
  geometry::set_polygons(*result, std::move(polygons));
  return result;
}

}  // namespace octosurf::planning
