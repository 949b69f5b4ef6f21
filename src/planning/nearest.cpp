#include "geometry/directions.hpp"
#include "planning/rings.hpp"
#include "planning/slope_limit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using planning::require_limit;
using planning::within;

// The point of the surface's polygons nearest to `uv`; empty without polygons.
std::optional<Eigen::Vector2d> closest_in_plane(const Surface& surface, const Eigen::Vector2d& uv) {
  std::optional<Eigen::Vector2d> best;
  double best2 = HUGE_VAL;
  for (const Polygon& polygon : surface.polygons) {
    if (planning::contains(polygon, uv)) return uv;
    planning::for_each_edge(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      const Eigen::Vector2d candidate = planning::closest_on_segment(a, b, uv);
      const double distance2 = (candidate - uv).squaredNorm();
      if (distance2 >= best2) return;
      best2 = distance2;
      best = candidate;
    });
  }
  return best;
}

void require_sensible(const Eigen::Vector3d& point, const SlopeLimit& limit, const char* where) {
  if (!point.allFinite()) throw Error(Error::Kind::usage, where, "the point is not finite");
  require_limit(limit);
}

/// The intersection of the ray from `point` along `direction` (unit) with the surface's polygons.
std::optional<Nearest> meet(const Surface& surface, const Eigen::Vector3d& point,
                            const Eigen::Vector3d& direction) {
  const Eigen::Vector3d from = surface.T_map_surface.inverse() * point;
  const Eigen::Vector3d along = surface.T_map_surface.linear().transpose() * direction;
  if (std::fabs(along.z()) < 1e-9) return {};  // parallel to the plane
  const double distance = -from.z() / along.z();
  if (distance < 0) return {};
  const Eigen::Vector2d uv = (from + distance * along).head<2>();
  const bool hit = std::any_of(surface.polygons.begin(), surface.polygons.end(),
                               [&](const Polygon& polygon) { return planning::contains(polygon, uv); });
  if (!hit) return {};
  return Nearest{surface.id, surface.to_map(uv), distance};
}

bool before(const Nearest& a, const Nearest& b) {
  return std::make_pair(a.distance, a.id) < std::make_pair(b.distance, b.id);
}

}  // namespace

std::optional<Nearest> nearest(const Snapshot& snapshot, const Eigen::Vector3d& point,
                               const SlopeLimit& limit) {
  require_sensible(point, limit, "nearest");
  // The distance to a plane is a lower bound for its polygons: nearest planes first, until a plane is farther
  // than the best found.
  std::vector<std::pair<double, const Surface*>> by_plane;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (!within(limit, *surface)) continue;
    by_plane.emplace_back(std::abs((surface->T_map_surface.inverse() * point).z()), surface.get());
  }
  std::sort(by_plane.begin(), by_plane.end(), [](const auto& a, const auto& b) {
    return std::make_pair(a.first, a.second->id) < std::make_pair(b.first, b.second->id);
  });

  std::optional<Nearest> best;
  for (const auto& [plane_distance, surface] : by_plane) {
    if (best && plane_distance > best->distance) break;
    const Eigen::Vector3d local = surface->T_map_surface.inverse() * point;
    const auto uv = closest_in_plane(*surface, local.head<2>());
    if (!uv) continue;
    const Eigen::Vector3d on_surface = surface->to_map(*uv);
    const Nearest found{surface->id, on_surface, (on_surface - point).norm()};
    if (!best || before(found, *best)) best = found;
  }
  return best;
}

std::optional<Nearest> below(const Snapshot& snapshot, const Eigen::Vector3d& point,
                             const SlopeLimit& limit) {
  require_sensible(point, limit, "below");
  const Eigen::Vector3d down = -limit.up.normalized();
  std::optional<Nearest> best;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if (!within(limit, *surface)) continue;
    const std::optional<Nearest> found = meet(*surface, point, down);
    if (found && (!best || before(*found, *best))) best = found;
  }
  return best;
}

}  // namespace octosurf
