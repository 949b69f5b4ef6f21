#include "shapes.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <random>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;

struct Flat {
  Eigen::Vector2d center;
  double radius;
};

// The guarantees of the header for a surface with one polygon.
void expect_valid(const Surface& on, double min_radius) {
  const Polygon& polygon = on.polygons.front();
  std::vector<Flat> flat;
  for (const Circle& circle : circles(on, min_radius)) {
    EXPECT_NEAR(on.plane.signed_distance(circle.center), 0, 1e-12);
    EXPECT_GE(circle.radius, min_radius);
    flat.push_back({to_uv(on, circle.center), circle.radius});
    EXPECT_TRUE(inside(polygon, flat.back().center));
    EXPECT_LE(circle.radius, edge_distance(polygon, flat.back().center) + 1e-12);
  }
  for (std::size_t i = 1; i < flat.size(); ++i) {
    EXPECT_LE(flat[i].radius, flat[i - 1].radius);
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GE((flat[i].center - flat[j].center).norm(), flat[j].radius - 1e-12);
    }
  }

  Eigen::Vector2d low = polygon.outer[0], high = low;
  for (const Eigen::Vector2d& p : polygon.outer) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const double step = std::max(min_radius, (high - low).maxCoeff() / 300);
  for (double v = low.y(); v <= high.y(); v += step) {
    for (int i = 0; low.x() + i * step <= high.x(); ++i) {
      const Eigen::Vector2d p(low.x() + i * step, v);
      if (!inside(polygon, p) || edge_distance(polygon, p) < min_radius + 1e-9) continue;
      EXPECT_TRUE(std::any_of(flat.begin(), flat.end(), [&](const Flat& circle) {
        return (circle.center - p).norm() <= circle.radius + 1e-9;
      })) << p.transpose();
    }
  }
}

TEST(Circles, SquareHasItsIncircleFirst) {
  const Surface on = surface(1, {{box(0, 0, 2, 2), {}}});
  const std::vector<Circle> found = circles(on, 0.1);
  ASSERT_FALSE(found.empty());
  EXPECT_NEAR(found[0].radius, 1, 1e-9);
  EXPECT_NEAR((found[0].center - Eigen::Vector3d(1, 1, 0)).norm(), 0, 1e-9);
  expect_valid(on, 0.1);
}

TEST(Circles, CoverMostOfACorridor) {
  const Surface on = surface(1, {{box(0, 0, 10, 1), {}}}, pose({1, 1, 0}, 0.4, {1, 2, 3}));
  expect_valid(on, 0.05);
  const std::vector<Circle> found = circles(on, 0.05);
  int covered = 0, all = 0;
  for (double u = 0.025; u < 10; u += 0.05) {
    for (double v = 0.025; v < 1; v += 0.05, ++all) {
      const Eigen::Vector3d p = on.to_map({u, v});
      covered += std::any_of(found.begin(), found.end(),
                             [&](const Circle& c) { return (c.center - p).norm() <= c.radius; });
    }
  }
  EXPECT_GT(covered, 0.95 * all);
}

TEST(Circles, NoneWhereNoneFits) {
  EXPECT_TRUE(circles(surface(1, {{box(0, 0, 10, 0.1), {}}}), 0.06).empty());
  EXPECT_TRUE(circles(Surface{}, 0.1).empty());
  EXPECT_THROW(circles(surface(1, {{{{0, 0}, {1, 1}, {2, 2}}, {}}}), 0.1), Error);  // that is no ring
}

TEST(Circles, TinyMinimumRadiusIsBoundedWork) { expect_valid(surface(1, {{box(0, 0, 2, 0.5), {}}}), 0.006); }

TEST(Circles, RefusesNonsense) {
  const Surface on = surface(1, {{box(0, 0, 1, 1), {}}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double radius : {0.0, -1.0, nan}) EXPECT_THROW(circles(on, radius), Error);
  EXPECT_THROW(circles(surface(1, {{{{0, 0}, {1, 0}, {nan, 1}}, {}}}), 0.1), Error);
}

TEST(Circles, RandomPolygonsWithHoles) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 20 && !HasFailure(); ++i) {
    expect_valid(surface(1, {random_polygon(random)}, pose({1, -2, 0.5}, 0.3 * i, {3, -5, 1.5})), 0.05);
  }
}

}  // namespace
}  // namespace octosurf::planning
