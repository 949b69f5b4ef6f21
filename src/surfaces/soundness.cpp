#include "surfaces/soundness.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace octosurf {

using Index = Workspace::Index;

SurfaceId parallel_sheet(Workspace& work, std::span<const Index> points, const Plane& plane, SurfaceId self) {
  std::map<SurfaceId, std::size_t> over;
  for (const Index i : points) {
    const VoxelPoint& p = work.window[i];
    for (const SurfaceId id : work.state.surfaces.near(p.key, 2)) {
      const SurfaceModel& surface = *work.state.surfaces.find(id);
      if (id == self || surface.size() <= points.size() || surface.plane().normal.dot(plane.normal) < 0.9)
        continue;
      if (std::fabs(surface.distance(p.position)) <= 1.3 * work.state.noise.tolerance(p, surface.plane()) &&
          surface.covers(surface.cell_of(p.position)))
        ++over[id];
    }
  }
  const auto found = std::find_if(over.begin(), over.end(),
                                  [&](const auto& entry) { return entry.second * 10 > points.size() * 6; });
  return found == over.end() ? 0 : found->first;
}

Plane fitted(Workspace& work, std::span<const Index> points, const Plane& toward) {
  const Eigen::Vector3d reference = work.window[points.front()].position.cast<double>();
  Moments moments;
  for (const Index i : points) {
    const double sigma = std::max(work.state.noise.sigma(work.window[i].range_class), 1e-6);
    moments.add(work.window[i].position.cast<double>() - reference, 1e-6 / (sigma * sigma));
  }
  const PlaneFit f = fit_plane(moments);
  Plane plane{f.normal, 0};
  if (plane.normal.dot(toward.normal) < 0) plane.normal = -plane.normal;
  plane.offset = plane.normal.dot(reference + f.centroid);
  return plane;
}

}  // namespace octosurf
