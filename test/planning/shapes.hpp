#pragma once

#include "support/testing.hpp"

#include <octosurf/surface.hpp>

namespace octosurf::shapes {

inline double ring_area(const Ring2& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

/// Holes are clockwise, so their areas are negative.
inline double area(const Polygon& polygon) {
  double sum = ring_area(polygon.outer);
  for (const Ring2& hole : polygon.holes) sum += ring_area(hole);
  return sum;
}

inline Ring2 box(double u, double v, double width, double height) {
  return {{u, v}, {u + width, v}, {u + width, v + height}, {u, v + height}};
}

inline Ring2 reversed(Ring2 ring) {
  std::reverse(ring.begin(), ring.end());
  return ring;
}

/// Star-shaped about its centre, so simple for any radii.
inline Ring2 star(std::mt19937_64& random, const Eigen::Vector2d& center, double inner, double outer,
                  int corners) {
  std::uniform_real_distribution<double> radius(inner, outer);
  Ring2 ring;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    ring.push_back(center + radius(random) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return ring;
}

/// A star with up to four holes, one in each quadrant of its kernel.
inline Polygon random_polygon(std::mt19937_64& random) {
  Polygon polygon{star(random, {0, 0}, 1.0, 2.0, 12 + static_cast<int>(random() % 49)), {}};
  for (const auto& [x, y] : {std::pair{.35, .35}, {-.35, .35}, {-.35, -.35}, {.35, -.35}}) {
    if (random() % 4 == 0) continue;
    polygon.holes.push_back(reversed(star(random, {x, y}, 0.05, 0.3, 3 + static_cast<int>(random() % 20))));
  }
  return polygon;
}

/// By winding number, summed from angles: slow, and unlike anything in the library.
inline bool inside(const Polygon& polygon, const Eigen::Vector2d& point) {
  double turns = 0;
  const auto add = [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d a = ring[i] - point, b = ring[(i + 1) % ring.size()] - point;
      turns += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)) / (2 * std::numbers::pi);
    }
  };
  add(polygon.outer);
  for (const Ring2& hole : polygon.holes) add(hole);
  return turns > 0.5;
}

/// Distance to the nearest edge, by looking at all of them.
inline double edge_distance(const Polygon& polygon, const Eigen::Vector2d& point) {
  double best = HUGE_VAL;
  const auto add = [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      const double t = std::clamp((point - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      best = std::min(best, (a + t * (b - a) - point).norm());
    }
  };
  add(polygon.outer);
  for (const Ring2& hole : polygon.holes) add(hole);
  return best;
}

/// Without a resolution: its simplified polygons are its polygons.
inline Surface surface(SurfaceId id, std::vector<Polygon> polygons,
                       const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  Surface result;
  result.id = id;
  result.T_map_surface = pose;
  result.plane.normal = pose.linear().col(2);
  result.plane.offset = result.plane.normal.dot(pose.translation());
  for (const Polygon& polygon : polygons) result.area_m2 += area(polygon);
  result.polygons = std::move(polygons);
  return result;
}

inline std::shared_ptr<Snapshot> snapshot_of(std::vector<Surface> surfaces) {
  auto snapshot = std::make_shared<Snapshot>();
  for (Surface& one : surfaces) snapshot->surfaces.push_back(std::make_shared<const Surface>(std::move(one)));
  return snapshot;
}

inline Eigen::Isometry3d pose(const Eigen::Vector3d& axis, double angle_rad, const Eigen::Vector3d& origin) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.rotate(Eigen::AngleAxisd(angle_rad, axis.normalized()));
  T.pretranslate(origin);
  return T;
}

inline Eigen::Vector2d to_uv(const Surface& on, const Eigen::Vector3d& point) {
  return (on.T_map_surface.inverse() * point).head<2>();
}

inline constexpr double pi = std::numbers::pi;

inline Eigen::Vector3d random_vector(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> uniform(-half, half);
  return {uniform(random), uniform(random), uniform(random)};
}

}  // namespace octosurf::shapes
