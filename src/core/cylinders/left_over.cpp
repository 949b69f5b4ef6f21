#include "cylinders/left_over.hpp"

#include "cylinders/region_growing.hpp"
#include "cylinders/seen_through.hpp"

namespace octosurf::cylinders {

LeftOver left_over(const surfaces::MapView& map, std::vector<PointId> points,
                   std::span<const PointId> seeds) {
  RegionGrowing grow(map, map.parameters);
  SeenThrough seen_through(map);
  LeftOver left{.regions = grow(seeds, [&](PointId i) { return seen_through(i) == 0; }),
                .points = std::move(points)};
  // Key order, so that RANSAC's draw does not depend on the order of traversal.
  for (std::vector<PointId>& region : left.regions) map.window.put_in_order(region);
  return left;
}

}  // namespace octosurf::cylinders
