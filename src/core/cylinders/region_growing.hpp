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
  using Index = occupancy::PointWindow::Index;

  RegionGrowing(const surfaces::MapView& map, const Parameters& parameters);

  /// Regions of n points and more.
  template <class Allowed>
  std::vector<std::vector<Index>> operator()(std::span<const Index> seeds, Allowed&& allowed);

 private:
  void sort_seeds(std::vector<Index>& seeds);
  bool visit(Index i);  // true the first time

  const surfaces::MapView& map_;
  std::size_t min_points_;
  float cos_smooth_;
  occupancy::PointWindow::Marks unvisited_;
};

template <class Allowed>
std::vector<std::vector<RegionGrowing::Index>> RegionGrowing::operator()(std::span<const Index> all_seeds,
                                                                         Allowed&& allowed) {
  std::vector<Index> seeds(all_seeds.begin(), all_seeds.end());
  sort_seeds(seeds);
  std::vector<std::vector<Index>> regions;
  std::vector<Index> region;
  for (const Index seed : seeds) {
    if (!allowed(seed) || !visit(seed)) continue;
    region.assign(1, seed);
    geometry::breadth_first(region, [&](Index from) {
      const surfaces::LocalPlane& here = map_.normals.at(from);
      if (!here.known || !here.flat) return;
      map_.window.for_each_near(map_.window[from].key, here.reach, unvisited_, [&](Index i) {
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
