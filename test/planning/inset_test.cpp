// A region by convolved outlines against the obvious way: everything cut out, edge by edge.
#include "geometry/ring_check.hpp"
#include "planning/blocked_polygon.hpp"
#include "planning/contact_shape.hpp"
#include "planning/exact_region.hpp"
#include "planning/rings.hpp"
#include "shapes.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace octosurf::planning {
namespace {

using namespace shapes;

std::vector<Polygon> slow_inset(const Polygon& polygon, const Ring2& kernel, std::vector<Ring2> besides) {
  for_each_edge(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    besides.push_back(minkowski_sum(kernel, {a, b}));
  });
  return remaining(polygon, besides);
}

/// The same but for what rounding to a µm changes along every edge.
void expect_same(const Polygon& polygon, const Ring2& kernel, const std::vector<Ring2>& besides = {}) {
  const std::vector<Polygon> fast = inset(polygon, kernel, besides);
  const std::vector<Polygon> slow = slow_inset(polygon, kernel, besides);
  EXPECT_FALSE(geometry::fault_of(fast));  // exactly: parts of a µm are some of Boost's own rounding
  EXPECT_LT(test::exact_difference(fast, slow), 2e-4);
}

Ring2 turned_box(double length, double width, double angle) {
  Ring2 ring = box(-length / 2, -width / 2, length, width);
  for (Eigen::Vector2d& p : ring) p = Eigen::Rotation2Dd(angle) * p;
  return ring;
}

TEST(Inset, OfRandomPolygons) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 40 && !HasFailure(); ++i) {
    const Polygon polygon = random_polygon(random);
    Ring2 kernel =
        turned_box(0.02 + 0.5 * uniform(random), 0.02 + 0.2 * uniform(random), 7 * uniform(random));
    if (i % 4 == 0) kernel = around_disc(0.3 * uniform(random) + 0.001);
    if (i % 4 == 1) kernel = minkowski_sum(kernel, around_disc(0.05));
    expect_same(polygon, kernel);
  }
}

TEST(Inset, BesidesWhatElseIsInTheWay) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int i = 0; i < 15 && !HasFailure(); ++i) {
    std::vector<Ring2> besides;
    for (int k = 0; k < 30; ++k) {
      Ring2 ring = k % 3 == 0 ? around_disc(0.2) : turned_box(0.1, 0.3, i + k);
      const Eigen::Vector2d at(uniform(random), uniform(random));
      for (Eigen::Vector2d& p : ring) p += at;
      besides.push_back(ring);
      if (k % 5 == 0) besides.push_back(ring);  // twice
    }
    expect_same(random_polygon(random), turned_box(0.2, 0.1, i), besides);
  }
}

// Their union, with holes that hold the kernel and holes that do not.
TEST(Inset, KeptOffObstacles) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int i = 0; i < 15 && !HasFailure(); ++i) {
    const Ring2 kernel = turned_box(0.2, 0.1, i), off = minkowski_sum(kernel, around_disc(0.05));
    std::vector<Ring2> boxes, blocked;
    for (int k = 0; k < 60; ++k) {
      Ring2 ring = turned_box(0.1, 0.6, i + 0.3 * k);
      const Eigen::Vector2d at(uniform(random), uniform(random));
      for (Eigen::Vector2d& p : ring) p += at;
      boxes.push_back(ring);
      blocked.push_back(minkowski_sum(off, ring));
    }
    const Polygon polygon = random_polygon(random);
    const std::vector<Polygon> obstacles = reshaped({}, boxes, {});
    EXPECT_LT(test::exact_difference(inset(polygon, kernel, {}, {{off, obstacles}}),
                                     slow_inset(polygon, kernel, blocked)),
              2e-4);
  }
}

// A lattice of voxels' squares beside one another, rings that touch, edges in line with one another and the
// kernel.
TEST(Inset, WhereEverythingCoincides) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 8 && !HasFailure(); ++i) {
    std::vector<Ring2> besides;
    Polygon polygon{box(0, 0, 2, 2), {}};
    for (int x = 0; x < 20; ++x)
      for (int y = 0; y < 20; ++y) {
        // With the room that callers leave, so that neighbours stay together.
        if (random() % 12 == 0)
          besides.push_back(
              box(0.1 * x - grid_slack, 0.1 * y - grid_slack, 0.1 + 2 * grid_slack, 0.1 + 2 * grid_slack));
        if (x % 4 == 2 && y % 4 == 2 && random() % 3 == 0)
          polygon.holes.push_back(reversed(box(0.1 * x, 0.1 * y, 0.1, 0.1)));
      }
    expect_same(polygon, box(-0.1, -0.05, 0.2, 0.1), besides);
  }
  const Polygon pinched{box(0, 0, 4, 4),
                        {reversed({{0, 0}, {2, 1}, {2, 2}, {1, 2}}), reversed({{2, 2}, {3, 2}, {3, 3}})}};
  for (const double angle : {0.0, 0.3, std::numbers::pi / 4})
    expect_same(pinched, turned_box(0.4, 0.2, angle));
}

// What a map's outline looks like: thousands of edges shorter than the kernel, rough.
TEST(Inset, OfARoughOutline) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 3 && !HasFailure(); ++i) {
    Polygon polygon{star(random, {0, 0}, 2.97, 3.0, 800), {}};
    for (const double x : {-1.2, 0.0, 1.2})
      polygon.holes.push_back(reversed(star(random, {x, 0.1}, 0.17, 0.2, 40)));
    expect_same(polygon, turned_box(0.22, 0.11, 0.4 + i));
  }
}

// fixed: holes that touch at a corner were one ring that came there twice, which readers of outlines refuse.
TEST(Reshaped, WhatTouchesAtACornerIsRingsOfItsOwn) {
  const Ring2 a = box(1, 1, 1, 1), b = box(2, 2, 1, 1), c = box(3, 1, 1, 1), at_rim = box(0, 2, 1, 2),
              beyond = box(4, 4, 1, 1);
  const Polygon square{box(0, 0, 4, 4), {}};
  const std::vector<Ring2> added{beyond}, removed{a, b, c, at_rim};
  const std::vector<Polygon> found = reshaped({&square, 1}, added, removed);
  EXPECT_FALSE(geometry::fault_of(found));
  double sum = 0;
  for (const Polygon& polygon : found) sum += area(polygon);
  EXPECT_NEAR(sum, 16 + 1 - 5, 1e-9);
}

}  // namespace
}  // namespace octosurf::planning
