// The downsampler against a std::map of voxels.
#include "sensing/downsample.hpp"

#include "support/random_scans.hpp"

#include <octomap/octomap.h>

namespace octosurf::sensing {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

struct Twin {
  struct Cell {
    std::uint32_t count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  std::map<std::uint64_t, Cell> cells;
  std::vector<std::uint64_t> order;
  std::size_t not_finite = 0, too_near = 0, out_of_map = 0, beyond_range = 0;
};

/// One point at a time, keys by OctoMap.
Twin slowly(const Scan& scan, double resolution, double min_range, double max_range) {
  const octomap::OcTree tree(resolution);
  const Eigen::Vector3f origin = scan.T_map_sensor.translation().cast<float>();
  Twin twin;
  for (const Eigen::Vector3f& p : scan.points) {
    if (!std::isfinite(p.x()) || !std::isfinite(p.y()) || !std::isfinite(p.z())) {
      ++twin.not_finite;
      continue;
    }
    if (p.cast<double>().norm() < min_range) {
      ++twin.too_near;
      continue;
    }
    const Eigen::Vector3f m =
        (scan.T_map_sensor.linear() * p.cast<double>() + scan.T_map_sensor.translation()).cast<float>();
    octomap::OcTreeKey key;
    if (!tree.coordToKeyChecked(octomap::point3d(m.x(), m.y(), m.z()), key)) {
      ++twin.out_of_map;
      continue;
    }
    const octomap::point3d centre = tree.keyToCoord(key);
    const octomap::point3d sensor(origin.x(), origin.y(), origin.z());
    if ((centre - sensor).norm() > max_range) ++twin.beyond_range;
    const std::uint64_t packed = geometry::VoxelKey{key[0], key[1], key[2]}.packed();
    Twin::Cell& cell = twin.cells[packed];
    if (cell.count++ == 0) twin.order.push_back(packed);
    cell.sum += m.cast<double>();
  }
  return twin;
}

void expect_same(const Scan& scan, Downsampler& downsample, double d, double min_range, double max_range) {
  const VoxelScan fast = downsample(scan, min_range, max_range);
  const Twin slow = slowly(scan, d, min_range, max_range);
  EXPECT_EQ(fast.not_finite, slow.not_finite);
  EXPECT_EQ(fast.too_near, slow.too_near);
  EXPECT_EQ(fast.out_of_map, slow.out_of_map);
  EXPECT_EQ(fast.beyond_range, slow.beyond_range);
  ASSERT_EQ(fast.ends.size(), slow.cells.size());
  std::size_t points = 0;
  for (std::size_t i = 0; i < fast.ends.size(); ++i) {
    const EndVoxel& end = fast.ends[i];
    ASSERT_EQ(end.key.packed(), slow.order[i]) << "not in the order of first touch";
    const Twin::Cell& cell = slow.cells.at(end.key.packed());
    ASSERT_EQ(end.count, cell.count);
    const Eigen::Vector3d centroid = cell.sum / cell.count;
    ASSERT_LT((end.centroid.cast<double>() - centroid).norm(), 1e-6 * (1 + centroid.norm()));
    ASSERT_EQ(downsample.find(end.key), static_cast<std::int64_t>(i));
    points += end.count;
  }
  for (const geometry::VoxelKey key : {geometry::VoxelKey{1, 2, 3}, {32768, 32768, 40000}})
    EXPECT_EQ(downsample.find(key) >= 0, slow.cells.contains(key.packed()));
  EXPECT_EQ(points + slow.not_finite + slow.too_near + slow.out_of_map, scan.points.size());
}

TEST(Downsample, EqualsAMapOfVoxels) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const double d : {0.004, 0.02, 0.1}) {
    Downsampler downsample{geometry::VoxelGrid(d)};
    for (int round = 0; round < 6; ++round) {
      const double far = d * 32768 * 0.9 * (round % 3) / 2;
      Scan scan = test::room_scan(rng, 20000, {1.4, 1.1, 0.9}, Eigen::Vector3d(far, -far, uniform(rng)));
      for (std::size_t i = 0; i < scan.points.size(); i += 97) {
        constexpr std::array<float, 4> bad{nan, inf, -inf, 3e38F};
        scan.points[i][static_cast<int>(rng() % 3)] = bad[rng() % 4];
      }
      for (std::size_t i = 50; i < scan.points.size(); i += 101) scan.points[i] *= 0.05F;
      expect_same(scan, downsample, d, round % 2 == 0 ? 0.1 : 0, round < 3 ? unlimited : 1.2);
    }
  }
}

TEST(Downsample, GrowsBeyondItsFirstTable) {
  Scan scan;
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<float> wide(-50, 50);
  for (int i = 0; i < 150000; ++i) scan.points.emplace_back(wide(rng), wide(rng), wide(rng));
  Downsampler downsample{geometry::VoxelGrid(0.01)};
  expect_same(scan, downsample, 0.01, 0, unlimited);
  scan.points.resize(10);  // nothing of the large scan is left behind
  expect_same(scan, downsample, 0.01, 0, unlimited);
}

/// Where rays start OccupancyInsert.ScansOfAMovingSensorEqualOctomapsStartByStart tells.
TEST(Downsample, RangesAreFromWhereRaysStartAndEachHasAStart) {
  Downsampler downsample{geometry::VoxelGrid(0.1)};
  Scan scan;
  scan.T_map_sensor.translation().x() = 5;
  scan.points = {{1.04F, 0, 0}, {2.04F, 0, 0}, {1.05F, 0, 0}, {3.04F, 0, 0}, {0.6F, 0, 0}};
  scan.origins = {{0.01F, 0, 0}, {0.51F, 0, 0}, {0.51F, 0, 0}, {0.02F, 0, 0}, {0.51F, 0, 0}};
  const VoxelScan voxels = downsample(scan, 0.2, 2.0);
  ASSERT_EQ(voxels.ends.size(), 3U);
  EXPECT_EQ(voxels.too_near, 1U);      // by 0.09 m
  EXPECT_EQ(voxels.beyond_range, 1U);  // 3.03 m
  scan.origins.pop_back();
  EXPECT_THROW(downsample(scan, 0.2, 2.0), Error);
  scan.origins.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  EXPECT_THROW(downsample(scan, 0, 2.0), Error);
}

}  // namespace
}  // namespace octosurf::sensing
