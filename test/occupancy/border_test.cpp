// Scans at the octree's very border: equal to OctoMap, and no step outside.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octomap_twin.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf {
namespace {

TEST(OccupancyBorder, EqualsOctomapUpToTheLastVoxel) {
  const std::uint64_t seed = test::fresh_seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double d = 0.05, border = d * 32768;
  for (const double max_range : {1e9, 0.7}) {
    for (int corner = 0; corner < 8; ++corner) {
      OccupancyParameters parameters;
      parameters.resolution = d;
      OccupancyMap ours(parameters);
      octomap::OcTree theirs(d);
      Downsampler downsample(ours.grid());
      for (int i = 0; i < 3; ++i) {
        Scan scan;
        for (int a = 0; a < 3; ++a)
          scan.T_map_sensor.translation()[a] =
              (corner >> a & 1 ? 1 : -1) * (border - 0.06 - 0.5 * std::fabs(uniform(rng)));
        for (int k = 0; k < 500; ++k)
          scan.points.push_back(
              (Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)).normalized() * (1.2 + uniform(rng)))
                  .cast<float>());
        const VoxelScan voxels = downsample(scan, 0, max_range);
        EXPECT_GT(voxels.out_of_map, 0U);
        test::insert_scan(theirs, scan, max_range > 1e6 ? -1 : max_range);
        ours.insert(voxels, downsample, nullptr);
      }
      SCOPED_TRACE("corner " + std::to_string(corner) + " max_range " + std::to_string(max_range));
      test::expect_equal(ours, theirs);
    }
  }
}

}  // namespace
}  // namespace octosurf
