#include "surfaces/criteria/soundness.hpp"

#include "geometry/local_width.hpp"
#include "geometry/plane_frame.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace octosurf::surfaces {

using Index = MapView::Index;

NoiseSheet noise_sheet_in(const MapView& map, std::span<const Index> points, const Plane& plane,
                          SurfaceId self) {
  constexpr double drift = 0.035;  // m, of poses between visits
  constexpr double min_cosine = 0.9;
  std::map<SurfaceId, std::vector<Index>> over;
  for (const Index i : points) {
    const occupancy::VoxelPoint& p = map.window[i];
    for (const SurfaceId id : map.surfaces.near(p.key, 2)) {
      const SurfaceModel& surface = *map.surfaces.find(id);
      if (id == self || surface.size() <= points.size() ||
          surface.plane().normal.dot(plane.normal) < min_cosine)
        continue;
      const double reach = std::max(drift, 1.3 * map.noise.tolerance(p, surface.plane()));
      if (std::fabs(surface.distance(p.position)) <= reach && surface.covers(surface.cell_of(p.position)))
        over[id].push_back(i);
    }
  }
  NoiseSheet largest;
  for (auto& [id, covered] : over)
    if (covered.size() > largest.points.size()) largest = {id, std::move(covered)};
  return largest;
}

SurfaceId noise_sheet_over(const MapView& map, std::span<const Index> points, const Plane& plane,
                           SurfaceId self) {
  const NoiseSheet sheet = noise_sheet_in(map, points, plane, self);
  return sheet.has_large_share_of(points.size()) ? sheet.over : 0;
}

std::optional<Refusal> narrow_strips(const MapView& map, std::span<const Index> points, const Plane& plane,
                                     double min_width) {
  const Eigen::Matrix3d axes = geometry::plane_axes(plane.normal);
  std::vector<Eigen::Vector2d> on_plane;
  on_plane.reserve(points.size());
  for (const Index i : points)
    on_plane.emplace_back(axes.leftCols<2>().transpose() * map.window[i].position.cast<double>());
  const std::optional<double> width =
      geometry::median_local_width(on_plane, min_width, map.grid.resolution());
  if (!width || *width >= min_width) return {};
  return Refusal{Reason::too_narrow, *width, min_width};
}

Plane fitted(const MapView& map, std::span<const Index> points, const Plane& toward) {
  const Eigen::Vector3d reference = map.window[points.front()].position.cast<double>();
  geometry::Moments moments;
  for (const Index i : points) {
    const double sigma = std::max(map.noise.sigma(map.window[i].range_class), 1e-6);
    moments.add(map.window[i].position.cast<double>() - reference, 1e-6 / (sigma * sigma));
  }
  return geometry::fitted_plane(moments, reference, toward.normal);
}

}  // namespace octosurf::surfaces
