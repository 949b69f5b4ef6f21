#pragma once

#include <vector>

#include <octosurf/map.hpp>

namespace octosurf::test {

/// Of every point, in the octree's order.
inline std::vector<SurfaceId> owners(const Map& map) {
  std::vector<SurfaceId> owners;
  map.for_each_point([&](const OccupancyView::Voxel& voxel) { owners.push_back(voxel.surface); });
  return owners;
}

}  // namespace octosurf::test
