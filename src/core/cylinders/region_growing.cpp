#include "cylinders/region_growing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

namespace octosurf::cylinders {

RegionGrowing::RegionGrowing(const surfaces::MapView& map, const Parameters& parameters)
    : map_(map),
      min_points_(static_cast<std::size_t>(parameters.min_surface_points())),
      cos_smooth_(static_cast<float>(std::cos(parameters.detection.smoothness_angle))) {}

bool RegionGrowing::visit(PointId i) { return unvisited_.remove(map_.window, i); }

void RegionGrowing::sort_seeds(std::vector<PointId>& seeds) {
  // Flattest first; ties by key, so that the points' order does not matter.
  std::vector<std::tuple<float, std::uint64_t, PointId>> ranked;
  ranked.reserve(seeds.size());
  for (const PointId i : seeds)
    if (const surfaces::LocalPlane& plane = map_.normals.at(i); plane.known && plane.flat)
      ranked.emplace_back(plane.curvature, map_.window[i].key.packed(), i);
  std::sort(ranked.begin(), ranked.end());
  seeds.clear();
  for (const auto& seed : ranked) seeds.push_back(std::get<PointId>(seed));
}

}  // namespace octosurf::cylinders
