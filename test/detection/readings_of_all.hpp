#pragma once

#include "detection/readings.hpp"

#include <vector>

namespace octosurf::test {

/// Of all points of a map, which are loaded into its window.
inline detection::Readings readings_of_all(const surfaces::MapView& map) {
  std::vector<PointId> cells;
  map.octree.for_each_point(
      [&](const occupancy::VoxelPoint& p) { cells.push_back(map.cells.of(map.window.find(p.key))); });
  map.cells.map().window.put_in_order(cells);
  return {map, {.points = cells, .may_join = {}, .context = {}}};
}

}  // namespace octosurf::test
