#include "evaluation/planar_region.hpp"

#include "hand_made.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <set>

namespace octosurf::evaluation {
namespace {

using namespace hand_made;

/// A star-shaped ring of random radii: simple, concave, no edge along an axis.
Ring2 random_ring(std::mt19937_64& random, const Eigen::Vector2d& centre, double inner, double outer) {
  std::uniform_real_distribution<double> radius(inner, outer);
  Ring2 ring;
  const int corners = 5 + static_cast<int>(random() % 40);
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * pi * i / corners;
    ring.push_back(centre + radius(random) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return ring;
}

TEST(PlanarRegion, AgreesWithBruteForceOnRandomPolygonsWithHolesAndIslands) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 random(seed);
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    std::uniform_real_distribution<double> within(-5, 5);
    const double x = within(random);
    const Eigen::Vector2d centre(x, within(random));
    const std::vector<Polygon> polygons{
        polygon(random_ring(random, centre, 0.8, 1.3), {random_ring(random, centre, 0.4, 0.7)}),
        polygon(random_ring(random, centre, 0.1, 0.3)),
        polygon(random_ring(random, centre + Eigen::Vector2d(3, 0), 0.2, 1.0))};
    const PlanarRegion region(polygons);
    const test::Region twin(polygons);
    std::uniform_real_distribution<double> u(centre.x() - 2, centre.x() + 5),
        v(centre.y() - 2, centre.y() + 2);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector2d p(u(random), v(random));
      const double distance = test::distance_to_rings(p, polygons);
      EXPECT_EQ(region.contains(p), twin.covers(p)) << p.transpose();
      EXPECT_NEAR(region.ring_distance(p), distance, 1e-12) << p.transpose();
      EXPECT_EQ(region.within(p, 0.1), twin.covers(p) || distance <= 0.1) << p.transpose();
      EXPECT_EQ(region.ring_distance(p, 0.1) <= 0.1, distance <= 0.1) << p.transpose();
    }
    std::set<std::pair<long, long>> cells;
    region.for_each_cell(0.05, [&](const Eigen::Vector2d& p) {
      cells.emplace(std::lround(p.x() / 0.05 - 0.5), std::lround(p.y() / 0.05 - 0.5));
    });
    std::set<std::pair<long, long>> expected;
    for (long i = -200; i < 300; ++i) {
      for (long j = -200; j < 200; ++j) {
        const Eigen::Vector2d p((double(i) + 0.5) * 0.05, (double(j) + 0.5) * 0.05);
        if ((p - centre).norm() < 6 && twin.covers(p)) expected.emplace(i, j);
      }
    }
    EXPECT_EQ(cells, expected);
  }
}

TEST(PlanarRegion, WithoutPolygonsHoldsNothing) {
  const PlanarRegion region({});
  EXPECT_TRUE(region.empty());
  EXPECT_FALSE(region.contains({0, 0}));
  EXPECT_FALSE(region.within({0, 0}, 1));
  EXPECT_TRUE(std::isinf(region.ring_distance({0, 0})));
  region.for_each_cell(0.01, [](const Eigen::Vector2d&) { FAIL(); });
}

TEST(PlanarRegion, AFlatRingHasNoInsideButADistance) {
  const PlanarRegion region({polygon({{0, 1}, {1, 1}, {2, 1}})});
  EXPECT_FALSE(region.contains({1, 1}));
  EXPECT_NEAR(region.ring_distance({1, 1.25}), 0.25, 1e-12);
  region.for_each_cell(0.01, [](const Eigen::Vector2d&) { FAIL(); });
}

TEST(PlanarRegion, RingsThatShareAVertexKeepTheirInsides) {
  const PlanarRegion region({polygon(box(0, 0, 1, 1)), polygon(box(1, 1, 2, 2))});
  EXPECT_TRUE(region.contains({0.5, 0.5}));
  EXPECT_TRUE(region.contains({1.5, 1.5}));
  EXPECT_FALSE(region.contains({1.5, 0.5}));
  EXPECT_NEAR(region.ring_distance({1.5, 0.5}), 0.5, 1e-12);
}

TEST(PlanarRegion, PointsOnARingAreSpreadEvenly) {
  std::vector<Eigen::Vector2d> points;
  for_each_on_ring(box(0, 0, 0.03, 0.02), 0.01, [&](const Eigen::Vector2d& p) { points.push_back(p); });
  ASSERT_EQ(points.size(), 10u);
  EXPECT_NEAR((points[0] - Eigen::Vector2d(0.005, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((points[3] - Eigen::Vector2d(0.03, 0.005)).norm(), 0, 1e-12);
  EXPECT_NEAR(enclosed_area(polygon(box(5, 5, 7, 8))), 6, 1e-12);
}

}  // namespace
}  // namespace octosurf::evaluation
