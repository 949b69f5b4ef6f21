#include "surfaces/criteria/soundness.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace octosurf {

using Index = Workspace::Index;

NoiseSheet noise_sheet_in(Workspace& work, std::span<const Index> points, const Plane& plane,
                          SurfaceId self) {
  constexpr double drift = 0.035;  // m, of poses between visits
  constexpr double min_cosine = 0.9;
  std::map<SurfaceId, std::vector<Index>> over;
  for (const Index i : points) {
    const VoxelPoint& p = work.window[i];
    for (const SurfaceId id : work.state.surfaces.near(p.key, 2)) {
      const SurfaceModel& surface = *work.state.surfaces.look_up(id);
      if (id == self || surface.size() <= points.size() ||
          surface.plane().normal.dot(plane.normal) < min_cosine)
        continue;
      const double reach = std::max(drift, 1.3 * work.state.noise.tolerance(p, surface.plane()));
      if (std::fabs(surface.distance(p.position)) <= reach && surface.covers(surface.cell_of(p.position)))
        over[id].push_back(i);
    }
  }
  NoiseSheet largest;
  for (auto& [id, covered] : over)
    if (covered.size() > largest.points.size()) largest = {id, std::move(covered)};
  return largest;
}

SurfaceId noise_sheet_over(Workspace& work, std::span<const Index> points, const Plane& plane,
                           SurfaceId self) {
  const NoiseSheet sheet = noise_sheet_in(work, points, plane, self);
  return sheet.has_large_share_of(points.size()) ? sheet.over : 0;
}

Plane fitted(Workspace& work, std::span<const Index> points, const Plane& toward) {
  const Eigen::Vector3d reference = work.window[points.front()].position.cast<double>();
  Moments moments;
  for (const Index i : points) {
    const double sigma = std::max(work.state.noise.sigma(work.window[i].range_class), 1e-6);
    moments.add(work.window[i].position.cast<double>() - reference, 1e-6 / (sigma * sigma));
  }
  return fitted_plane(moments, reference, toward.normal);
}

}  // namespace octosurf
