// Neighbourhood queries against brute force over all voxels.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/point_window.hpp"
#include "support/random_scans.hpp"

namespace octosurf::occupancy {
namespace {

class Window : public ::testing::Test {
 protected:
  static OccupancyMap scanned_twice(std::mt19937_64& rng) {
    OccupancyMap scanned(test::with_resolution(0.05));
    for (int i = 0; i < 2; ++i)  // across the origin: keys on both sides of 2¹⁵
      test::insert(scanned, test::room_scan(rng, 4000, {0.8, 0.6, 0.5}, {0.1, 0.2, -0.3}, 0.05));
    return scanned;
  }

  std::mt19937_64 rng = test::rng();
  OccupancyMap map = scanned_twice(rng);
  const std::vector<VoxelPoint> points = test::points_of(map);
  PointWindow window{map};
};

geometry::VoxelKey random_key_near(const std::vector<VoxelPoint>& points, std::mt19937_64& rng) {
  const geometry::VoxelKey k = points[rng() % points.size()].key;
  const auto jitter = [&](std::uint16_t c) { return static_cast<std::uint16_t>(c + rng() % 9 - 4); };
  return {jitter(k.x), jitter(k.y), jitter(k.z)};
}

TEST_F(Window, FindsWhatBruteForceFinds) {
  std::map<std::uint64_t, VoxelPoint> by_key;
  for (const VoxelPoint& p : points) by_key[p.key.packed()] = p;
  for (int i = 0; i < 3000; ++i) {
    const geometry::VoxelKey key = random_key_near(points, rng);
    const PointId found = window.find(key);
    const auto expected = by_key.find(key.packed());
    ASSERT_EQ(found == PointId::none, expected == by_key.end());
    if (found == PointId::none) continue;
    EXPECT_EQ(window[found].key, key);
    EXPECT_EQ(window[found].position, expected->second.position);
    EXPECT_EQ(window[found].place, expected->second.place);
  }
}

TEST_F(Window, VisitsWhatBruteForceVisitsOnceEach) {
  for (int i = 0; i < 300; ++i) {
    const geometry::VoxelKey key = random_key_near(points, rng);
    const int reach = static_cast<int>(rng() % 12);
    std::vector<std::uint64_t> visited, expected;
    window.for_each_near(key, reach, [&](PointId k) { visited.push_back(window[k].key.packed()); });
    for (const VoxelPoint& p : points)
      if (std::abs(p.key.x - key.x) <= reach && std::abs(p.key.y - key.y) <= reach &&
          std::abs(p.key.z - key.z) <= reach)
        expected.push_back(p.key.packed());
    const std::vector<std::uint64_t> first = visited;
    std::sort(visited.begin(), visited.end());
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(visited, expected) << "reach " << reach;
    std::vector<std::uint64_t> again;
    PointWindow fresh(map);  // a fixed order, whatever was loaded before
    fresh.for_each_near(key, reach, [&](PointId k) { again.push_back(fresh[k].key.packed()); });
    ASSERT_EQ(first, again);
  }
}

// Callers hold a point while they ask for its neighbours, and asking reads blocks.
TEST_F(Window, AReferenceStaysGoodWhileTheWindowGrows) {
  const PointId i = window.find(points.front().key);
  const VoxelPoint& held = window[i];
  const std::size_t before = window.size();
  for (const VoxelPoint& p : points) window.find(p.key);
  ASSERT_GT(window.size(), 10 * before);  // it has grown
  ASSERT_EQ(&held, &window[i]);           // first: what moved may not even be read
  EXPECT_EQ(held.key, points.front().key);
  EXPECT_EQ(held.position, points.front().position);
  window.assign(i, 7);
  EXPECT_EQ(held.surface, 7U);
  EXPECT_EQ(map.at(held.key).point->surface, 7U) << "in the octree, too";
}

TEST(PointWindow, StopsAtTheBorderOfTheOctree) {
  OccupancyMap map{OccupancyParameters{}};
  const float border = 0.02F * 32768;
  Scan scan;
  scan.T_map_sensor.translation().setConstant(-border + 0.3);
  for (int i = 0; i < 20; ++i)
    scan.points.push_back(Eigen::Vector3f::Constant(-0.29F + 0.002F * static_cast<float>(i)));
  test::insert(map, scan, 10);
  PointWindow window(map);
  std::size_t visited = 0;
  window.for_each_near({0, 0, 0}, 40, [&](PointId) { ++visited; });
  EXPECT_EQ(visited, test::points_of(map).size());
  EXPECT_GT(visited, 0U);
  visited = 0;
  window.for_each_near({65535, 65535, 65535}, 40, [&](PointId) { ++visited; });
  EXPECT_EQ(visited, 0U);
}

}  // namespace
}  // namespace octosurf::occupancy
