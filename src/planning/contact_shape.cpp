#include "planning/contact_shape.hpp"

#include "geometry/directions.hpp"
#include "planning/rings.hpp"

#include <algorithm>

#include <octosurf/error.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using planning::cross;

void require(bool holds, const char* where, const char* what, const char* hint) {
  if (!holds) throw Error(Error::Kind::usage, where, what, hint);
}

void require_length(double value, const char* where) {
  require(value >= 0 && std::isfinite(value), where, "is not a length", "must be 0 m or more");
}

void require_positive(const std::optional<double>& value, const char* where) {
  require(!value || *value >= 0, where, "is not a limit", "must be 0 or more");
}

void require_shape(const ContactShape& shape) {
  if (shape.outline.empty()) {
    require_length(shape.radius, "contact radius");
    return;
  }
  for (const Eigen::Vector2d& p : shape.outline)
    require(p.allFinite(), "contact outline", "a vertex is not finite", "");
  const std::size_t n = shape.outline.size();
  double turned = 0;  // total turn: one revolution, not two
  bool left = n >= 3;
  for (std::size_t i = 0; i < n && left; ++i) {
    const Eigen::Vector2d in = shape.outline[(i + 1) % n] - shape.outline[i];
    const Eigen::Vector2d out = shape.outline[(i + 2) % n] - shape.outline[(i + 1) % n];
    left = cross(in, out) >= 0 && in.squaredNorm() > 0;
    turned += std::atan2(cross(in, out), in.dot(out));
  }
  require(left && std::abs(turned - 2 * std::numbers::pi) < 1, "contact outline",
          "is not convex and counter-clockwise", "give its hull, three vertices or more");
}

}  // namespace

Ring2 planning::around_disc(double radius) {
  if (radius <= 0) return {Eigen::Vector2d::Zero()};
  Ring2 ring;
  const double corner = radius / std::cos(std::numbers::pi / planning::disc_corners);
  for (int i = 0; i < planning::disc_corners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / planning::disc_corners;
    ring.emplace_back(corner * std::cos(angle), corner * std::sin(angle));
  }
  return ring;
}

// Andrew's monotone chain.
Ring2 planning::convex_hull(Ring2 points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  Ring2 hull;
  const auto add = [&hull](const Eigen::Vector2d& p, std::size_t keep) {
    while (hull.size() > keep && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Eigen::Vector2d& p : points) add(p, 1);
  const std::size_t lower = hull.size();
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  hull.pop_back();
  return hull;
}

// The edges of both in the order of their directions, from the lowest corner on.
Ring2 planning::minkowski_sum(const Ring2& a, const Ring2& b) {
  const auto lowest = [](const Ring2& ring) {
    const auto is_lower = [](const auto& p, const auto& q) {
      return p.y() != q.y() ? p.y() < q.y() : p.x() < q.x();
    };
    return static_cast<std::size_t>(std::min_element(ring.begin(), ring.end(), is_lower) - ring.begin());
  };
  const std::size_t first_a = lowest(a), first_b = lowest(b), n = a.size(), m = b.size();
  Ring2 sum;
  for (std::size_t i = 0, k = 0; i < n || k < m;) {
    const Eigen::Vector2d &p = a[(first_a + i) % n], &q = b[(first_b + k) % m];
    sum.push_back(p + q);
    const double turn = i == n   ? -1
                        : k == m ? 1
                                 : cross(a[(first_a + i + 1) % n] - p, b[(first_b + k + 1) % m] - q);
    i += turn >= 0;
    k += turn <= 0;
  }
  return sum;
}

Ring2 planning::mirrored(Ring2 ring) {
  for (Eigen::Vector2d& p : ring) p = -p;
  return ring;
}

ContactShape ContactShape::rectangle(double length, double width, std::optional<double> behind) {
  require(length > 0 && width > 0 && std::isfinite(length) && std::isfinite(width), "contact",
          "is not a rectangle", "length and width must be above 0 m");
  const double heel = -behind.value_or(length / 2), toe = heel + length;
  ContactShape shape;
  shape.outline = {{heel, -width / 2}, {toe, -width / 2}, {toe, width / 2}, {heel, width / 2}};
  return shape;
}

ContactShape ContactShape::disc(double radius) {
  ContactShape shape;
  shape.radius = radius;
  require_shape(shape);
  return shape;
}

double ContactShape::reach() const {
  double farthest = outline.empty() ? radius : 0;
  for (const Eigen::Vector2d& p : outline) farthest = std::max(farthest, p.norm());
  return farthest;
}

Eigen::Vector2d heading_on(const Surface& surface, double yaw_rad, const Eigen::Vector3d& up) {
  geometry::require_direction(up, "up");
  const Eigen::Vector3d level =
      upright(up).conjugate() * Eigen::Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0);
  const Eigen::Matrix3d R_surface_map = surface.T_map_surface.linear().transpose();
  const Eigen::Vector2d along = (R_surface_map * level).head<2>();
  // Below a millionth of a right angle the projection is mostly rounding error.
  if (along.norm() > 1e-6) return along.normalized();
  return (R_surface_map * up).head<2>().normalized();
}

planning::Sole planning::sole_of(const ContactShape& shape, const Surface& surface,
                                 std::optional<double> yaw_rad, const Eigen::Vector3d& up) {
  planning::Sole sole;
  if (!yaw_rad || shape.outline.empty()) {
    // Not rotated: the polygon about a disc is not round, but a disc's heading must not matter.
    sole.outline = planning::around_disc(shape.reach());
    return sole;
  }
  sole.heading = heading_on(surface, *yaw_rad, up);
  for (const Eigen::Vector2d& p : shape.outline) sole.middle += p / static_cast<double>(shape.outline.size());
  sole.outline = shape.outline;
  for (Eigen::Vector2d& p : sole.outline) p -= sole.middle;
  sole.outline = planning::convex_hull(std::move(sole.outline));
  return sole;
}

void planning::require_sensible(const ContactShape& shape, std::optional<double> yaw_rad,
                                const ContactLimits& limits, const OccupancyView* octree) {
  require_shape(shape);
  require(!yaw_rad || std::isfinite(*yaw_rad), "yaw", "is not finite", "");
  geometry::require_direction(limits.up, "up");
  require(limits.max_slope_rad >= 0, "max_slope", "is not an angle", "must be at least 0");
  require_length(limits.min_area_m2, "min_area");
  require_length(limits.edge_margin_m, "edge_margin");
  require_length(limits.obstacle_margin_m, "obstacle_margin");
  require_length(limits.obstacle_from_m, "obstacle_from");
  require_length(limits.clearance_m, "clearance");
  require_length(limits.unknown_to_m, "unknown_to");
  constexpr double farthest = 10;  // m: farther than legs
  require(shape.reach() + std::max(limits.edge_margin_m, limits.obstacle_margin_m) <= farthest, "contact",
          "reaches over 10 m with its margins", "give metres");
  require_positive(limits.max_rms_m, "max_rms");
  require_positive(limits.max_normal_std_rad, "max_normal_std");
  require_positive(limits.max_offset_std_m, "max_offset_std");
  require(limits.obstacle_margin_m == 0 || limits.clearance_m > 0, "obstacle_margin",
          "has no height to look for obstacles in", "give a clearance, too");
  require(octree != nullptr || limits.clearance_m == 0, "clearance", "cannot be known without an octree",
          "give the map's occupancy view");
  require(octree != nullptr || limits.unknown_to_m == 0, "unknown_to", "cannot be checked without an octree",
          "give the map's occupancy view");
}

std::vector<ContactRefusal> planning::refusals_of(const Surface& surface, const ContactLimits& limits) {
  std::vector<ContactRefusal> refused;
  // At π rounding must not cause a refusal.
  if (limits.max_slope_rad < std::numbers::pi && slope_rad(surface, limits.up) > limits.max_slope_rad)
    refused.push_back(ContactRefusal::slope);
  if (surface.area_m2 < limits.min_area_m2) refused.push_back(ContactRefusal::size);
  if (limits.max_rms_m && surface.rms_m > *limits.max_rms_m) refused.push_back(ContactRefusal::roughness);
  if ((limits.max_normal_std_rad && surface.normal_std_rad() > *limits.max_normal_std_rad) ||
      (limits.max_offset_std_m && surface.offset_std_m() > *limits.max_offset_std_m))
    refused.push_back(ContactRefusal::uncertainty);
  return refused;
}

}  // namespace octosurf
