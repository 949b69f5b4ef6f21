#pragma once

#include "geometry/breadth_first.hpp"
#include "surfaces/map_view.hpp"

#include <span>
#include <vector>

namespace octosurf::cylinders {

/// Smoothly connected regions of pending points (paper III-C3; Rabbani et al. 2006): from the flattest seed
/// to neighbours whose normals differ by less than the smoothness angle from the point before; points that
/// are not flat are added but not extended.
///
/// Grows from `seeds` only, through all pending points that `allowed` accepts. The order of regions and of
/// their points is fixed by geometry.
class RegionGrowing {
 public:
  RegionGrowing(const surfaces::MapView& map, const Parameters& parameters);

  /// Regions of n points and more.
  template <class Allowed>
  std::vector<std::vector<PointId>> operator()(std::span<const PointId> seeds, Allowed&& allowed);

 private:
  void sort_seeds(std::vector<PointId>& seeds);
  bool visit(PointId i);  // true the first time

  const surfaces::MapView& map_;
  std::size_t min_points_;
  float cos_smooth_;
  occupancy::PointWindow::Marks unvisited_;
};

template <class Allowed>
std::vector<std::vector<PointId>> RegionGrowing::operator()(std::span<const PointId> all_seeds,
                                                            Allowed&& allowed) {
  std::vector<PointId> seeds(all_seeds.begin(), all_seeds.end());
  sort_seeds(seeds);
  std::vector<std::vector<PointId>> regions;
  std::vector<PointId> region;
  for (const PointId seed : seeds) {
    if (!allowed(seed) || !visit(seed)) continue;
    region.assign(1, seed);
    geometry::breadth_first(region, [&](PointId from) {
      const surfaces::LocalPlane& here = map_.normals.at(from);
      if (!here.known || !here.flat) return;
      map_.window.for_each_near(map_.window[from].key, here.reach, unvisited_, [&](PointId i) {
        const surfaces::LocalPlane& there = map_.normals.at(i);
        if (!there.known || there.normal.dot(here.normal) < cos_smooth_ || !allowed(i)) return;
        visit(i);
        region.push_back(i);
      });
    });
    if (region.size() >= min_points_) regions.push_back(region);
  }
  return regions;
}

}  // namespace octosurf::cylinders
