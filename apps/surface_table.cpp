#include "surface_table.hpp"

#include <algorithm>
#include <cstdio>

namespace octosurf {

std::vector<SurfacePtr> largest_surfaces(const Snapshot& snapshot, std::size_t count) {
  std::vector<SurfacePtr> surfaces = snapshot.surfaces;
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const SurfacePtr& a, const SurfacePtr& b) { return a->area_m2 > b->area_m2; });
  surfaces.resize(std::min(count, surfaces.size()));
  return surfaces;
}

void print_table(const std::vector<SurfacePtr>& surfaces) {
  std::printf(" surface   area m²   inliers   rms mm                  normal   offset m\n");
  for (const SurfacePtr& surface : surfaces) {
    const Eigen::Vector3d& n = surface->plane.normal;
    std::printf("%8u %9.3f %9zu %8.1f    %6.3f %6.3f %6.3f %10.3f\n", surface->id, surface->area_m2,
                surface->inliers, 1e3 * surface->rms_m, n.x(), n.y(), n.z(), surface->plane.offset);
  }
}

double total_area(const Snapshot& snapshot) {
  double area_m2 = 0;
  for (const SurfacePtr& surface : snapshot.surfaces) area_m2 += surface->area_m2;
  return area_m2;
}

}  // namespace octosurf
