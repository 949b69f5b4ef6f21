// Neighbourhood queries against brute force over all voxels.
#include "occupancy/neighbours.hpp"
#include "occupancy/octree_bytes.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/point_window.hpp"
#include "support/pending_points.hpp"
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

// Cached neighbours equal those of a search over all points.

TEST(Neighbours, AreAllPointsWithinTheSmallestDistanceThatGivesSix) {
  std::mt19937_64 rng = test::rng();
  // Dense at first, then ever sparser, up to lonely points.
  Scan scan;
  std::exponential_distribution<float> away(4);
  std::uniform_real_distribution<float> side(-1, 1);
  for (int k = 0; k < 1500; ++k)
    scan.points.emplace_back(away(rng) * side(rng), away(rng) * side(rng), 1 + away(rng) * side(rng));
  const test::PendingPoints points({scan});
  const PointWindow& window = points.ledger.window;
  const Neighbours neighbours(window, 0.02);
  const auto distance = [&](PointId a, PointId b) {
    const geometry::VoxelKey p = window[a].key, q = window[b].key;
    return std::max({std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)});
  };
  const auto within = [&](PointId i, int reach) {
    std::vector<PointId> near;
    for (const PointId j : points.all)
      if (j != i && distance(i, j) <= reach) near.push_back(j);
    return near;
  };
  for (const PointId i : points.all) {
    int reach = 1;
    while (reach < 8 && within(i, reach).size() < 6) ++reach;
    std::vector<PointId> found(neighbours.of(i).begin(), neighbours.of(i).end()), nearer;
    std::vector<PointId> expected = within(i, reach);
    std::sort(found.begin(), found.end());
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(found, expected);
    const int limit = 1 + static_cast<int>(rng() % 8);
    neighbours.for_each_within(i, limit, [&](PointId j) { nearer.push_back(j); });
    std::sort(nearer.begin(), nearer.end());
    expected = within(i, std::min(limit, reach));
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(nearer, expected) << limit;
  }
}

// What a voxel with a point carries.

TEST(Payload, PointComesBackWithinHalfAStep) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> inside(0, 1), far(-200, 200);
  for (const double d : {0.005, 0.02, 0.11}) {
    const geometry::VoxelGrid grid(d);
    for (int i = 0; i < 5000; ++i) {
      geometry::VoxelKey key;
      ASSERT_TRUE(grid.key_of(Eigen::Vector3d(far(rng), far(rng), far(rng))
                                  .cwiseMin(30000 * d)
                                  .cwiseMax(-30000 * d)
                                  .cast<float>(),
                              key));
      const Eigen::Vector3d point =
          grid.corner_of(key) + d * Eigen::Vector3d(inside(rng), inside(rng), inside(rng));
      VoxelPayload payload;
      store_point(payload, grid, key, point.cast<float>(), Eigen::Vector3f::Zero());
      ASSERT_TRUE(payload.has_point());
      const Eigen::Vector3f back = load_point(payload, grid, key).cast<float>();
      const double rounding = 4 * std::numeric_limits<float>::epsilon() * point.norm();
      ASSERT_LE((back.cast<double>() - point).cwiseAbs().maxCoeff(), d / 512 + rounding);
      geometry::VoxelKey again;
      ASSERT_TRUE(grid.key_of(back, again));
      if (d > 100 * rounding) {
        ASSERT_EQ(again, key) << "a stored point left its voxel";
      }
    }
  }
}

TEST(Payload, PointOutsideItsVoxelIsDrawnToItsBorder) {
  const geometry::VoxelGrid grid(0.02);
  const geometry::VoxelKey key{40000, 30000, 32768};
  VoxelPayload payload;
  store_point(payload, grid, key, grid.centre_of(key) + Eigen::Vector3f(0.1F, -0.1F, 0),
              Eigen::Vector3f::Zero());
  const Eigen::Vector3d back = load_point(payload, grid, key) - grid.corner_of(key);
  EXPECT_NEAR(back.x(), 0.02, 1e-4);
  EXPECT_NEAR(back.y(), 0, 1e-4);
}

TEST(Payload, ViewIsExactToFourDegrees) {
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<float> gauss;
  const auto check = [](const Eigen::Vector3f& v) {
    const Eigen::Vector3f back = sensing::decode_view(sensing::encode_view(v));
    EXPECT_NEAR(back.norm(), 1, 1e-5);
    EXPECT_LT(sensing::encode_view(v), 1U << 12);
    const double angle = std::acos(std::min(1.0F, back.dot(v.normalized()))) * 180 / std::numbers::pi;
    // Worst in the middle of an octant: half a step of 2/63 along both coordinates is √6/63 at 1/√3.
    EXPECT_LE(angle, 3.9) << v.transpose();
  };
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0)
          check(Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)));
  for (int i = 0; i < 20000; ++i) check({gauss(rng), gauss(rng), gauss(rng)});
}

TEST(Payload, RangeClassIsExactToRootTwo) {
  EXPECT_EQ(sensing::range_class_of(0), 1U);  // 0 would be "no point"
  EXPECT_EQ(sensing::range_class_of(0.25F), 1U);
  EXPECT_EQ(sensing::range_class_of(1e30F), 15U);
  unsigned last = 1;
  for (float r = 0.25F; r < 32; r *= 1.01F) {
    const unsigned c = sensing::range_class_of(r);
    EXPECT_GE(c, last);
    last = c;
    EXPECT_LE(sensing::range_of_class(c), r * std::sqrt(2.0F));
    EXPECT_GE(sensing::range_of_class(c), r / std::sqrt(2.0F));
  }
}

}  // namespace
}  // namespace octosurf::occupancy
