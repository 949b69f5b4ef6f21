#include "surface_table.hpp"

#include <algorithm>
#include <cstdio>
#include <numbers>

#include <octosurf/up.hpp>

namespace octosurf {

std::vector<SurfacePtr> largest_surfaces(const Snapshot& snapshot, std::size_t count) {
  std::vector<SurfacePtr> surfaces = snapshot.surfaces;
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const SurfacePtr& a, const SurfacePtr& b) { return a->area_m2 > b->area_m2; });
  surfaces.resize(std::min(count, surfaces.size()));
  return surfaces;
}

void print_table(const std::vector<SurfacePtr>& surfaces, const Eigen::Vector3d& up) {
  std::printf(" surface   area m²   inliers   rms mm  slope °                  normal   offset m\n");
  for (const SurfacePtr& surface : surfaces) {
    const Eigen::Vector3d& n = surface->plane.normal;
    std::printf("%8u %9.3f %9zu %8.1f %8.1f    %6.3f %6.3f %6.3f %10.3f\n", surface->id, surface->area_m2,
                surface->inliers, 1e3 * surface->rms_m, slope_rad(*surface, up) * 180 / std::numbers::pi,
                n.x(), n.y(), n.z(), surface->plane.offset);
  }
}

void print_table(const std::vector<CylinderPtr>& cylinders) {
  std::printf("cylinder  radius m  length m   span °   inliers   rms mm                    axis\n");
  for (const CylinderPtr& c : cylinders)
    std::printf("%8u %9.3f %9.3f %8.0f %9zu %8.1f    %6.3f %6.3f %6.3f\n", c->id, c->radius_m, c->length_m,
                c->span_rad * 180 / std::numbers::pi, c->inliers, 1e3 * c->rms_m, c->axis.x(), c->axis.y(),
                c->axis.z());
}

void print_table(const std::vector<Stair>& stairs) {
  std::printf(
      "   stair      kind  risers  riser m     ±   tread m     ±  width m  heading °  turn °  treads\n");
  for (const Stair& s : stairs) {
    std::printf("%8u %9s %7zu %8.3f %5.3f %9.3f %5.3f %8.2f %10.1f %7.0f ", s.id,
                stair_kind_names[static_cast<std::size_t>(s.kind)].data(), s.steps.size(), s.riser.mean_m,
                s.riser.std_m, s.tread.mean_m, s.tread.std_m, s.width_m,
                s.heading_rad * 180 / std::numbers::pi, s.turn_rad * 180 / std::numbers::pi);
    for (const SurfaceId tread : s.treads) std::printf(" %u", tread);
    std::printf("\n");
  }
}

double total_area(const Snapshot& snapshot) {
  double area_m2 = 0;
  for (const SurfacePtr& surface : snapshot.surfaces) area_m2 += surface->area_m2;
  return area_m2;
}

}  // namespace octosurf
