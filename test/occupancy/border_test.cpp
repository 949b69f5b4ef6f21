// Scans at the octree's very border. OctoMap is no twin here: its rays overrun their buffer.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octomap_twin.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace octosurf::occupancy {
namespace {

TEST(OccupancyBorder, ScansEndAtTheLastVoxel) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double d = 0.05, border = d * 32768;
  for (const double max_range : {std::numeric_limits<double>::infinity(), 0.7})
    for (int corner = 0; corner < 8; ++corner) {
      OccupancyMap map(test::with_resolution(d));
      sensing::Downsampler downsample(map.grid());
      Scan scan;
      for (int a = 0; a < 3; ++a)
        scan.T_map_sensor.translation()[a] =
            ((corner >> a & 1) ? 1 : -1) * (border - 0.06 - 0.5 * std::fabs(uniform(rng)));
      for (int k = 0; k < 500; ++k)
        scan.points.push_back(
            (Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)).normalized() * (1.2 + uniform(rng)))
                .cast<float>());
      const sensing::VoxelScan voxels = downsample(scan, 0, max_range);
      EXPECT_GT(voxels.out_of_map, 0U);
      const OccupancyDelta delta = map.insert(voxels, downsample, nullptr);

      std::size_t hits = 0;
      for (const sensing::EndVoxel& end : voxels.ends)
        if (voxels.within_range(end, map.grid().centre_of(end.key))) {
          ++hits;
          EXPECT_EQ(map.at(end.key).state, OccupancyMap::State::occupied);
        }
      EXPECT_EQ(delta.appeared.size(), hits);
      // Nothing is known beyond the rays: no step wrapped around to the other side.
      const octomap::OcTree known = test::through_bt(map);
      for (auto leaf = known.begin_leafs(); leaf != known.end_leafs(); ++leaf) {
        const octomap::point3d c = leaf.getCoordinate();
        const double farthest = std::min(max_range, 2.2) + leaf.getSize() + 2 * d;
        EXPECT_LE((Eigen::Vector3d(c.x(), c.y(), c.z()) - scan.T_map_sensor.translation()).norm(), farthest);
      }
    }
}

}  // namespace
}  // namespace octosurf::occupancy
