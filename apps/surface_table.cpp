#include "surface_table.hpp"

#include "geometry/degrees.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include <octosurf/up.hpp>

namespace octosurf {

nlohmann::ordered_json largest_surfaces(const Snapshot& snapshot, std::size_t count,
                                        const Eigen::Vector3d& up) {
  std::vector<SurfacePtr> surfaces = snapshot.surfaces;
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const SurfacePtr& a, const SurfacePtr& b) { return a->area_m2 > b->area_m2; });
  surfaces.resize(std::min(count, surfaces.size()));
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const SurfacePtr& surface : surfaces)
    list.push_back({{"id", surface->id},
                    {"area_m2", surface->area_m2},
                    {"inliers", surface->inliers},
                    {"rms_m", surface->rms_m},
                    {"normal", surface->plane.normal},
                    {"offset", surface->plane.offset},
                    {"slope_deg", slope_rad(*surface, up) * deg_per_rad}});
  return list;
}

double total_area(const Snapshot& snapshot) {
  double area_m2 = 0;
  for (const SurfacePtr& surface : snapshot.surfaces) area_m2 += surface->area_m2;
  return area_m2;
}

}  // namespace octosurf
