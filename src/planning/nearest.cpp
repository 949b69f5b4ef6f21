#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

// The point of the surface's polygons nearest to `uv`; nothing if it has none.
std::optional<Eigen::Vector2d> closest_in_plane(const Surface& surface, const Eigen::Vector2d& uv) {
  std::optional<Eigen::Vector2d> best;
  double best2 = HUGE_VAL;
  for (const Polygon& polygon : surface.polygons) {
    if (contains(polygon, uv)) return uv;
    for_each_edge(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      const Eigen::Vector2d candidate = closest_on_segment(a, b, uv);
      const double distance2 = (candidate - uv).squaredNorm();
      if (distance2 >= best2) return;
      best2 = distance2;
      best = candidate;
    });
  }
  return best;
}

}  // namespace

std::optional<Nearest> nearest(const Snapshot& snapshot, const Eigen::Vector3d& point) {
  if (!point.allFinite()) throw Error(Error::Kind::usage, "nearest", "the point is not finite");
  // The distance to a plane bounds that to its polygons from below: nearest planes first, and none
  // whose plane is already farther than the best found.
  std::vector<std::pair<double, const Surface*>> by_plane;
  for (const SurfacePtr& surface : snapshot.surfaces) {
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
    const double distance = (on_surface - point).norm();
    if (!best || std::make_pair(distance, surface->id) < std::make_pair(best->distance, best->id)) {
      best = Nearest{surface->id, on_surface, distance};
    }
  }
  return best;
}

}  // namespace octosurf
