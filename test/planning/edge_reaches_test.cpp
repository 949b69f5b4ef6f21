// Eight edges asked at once against each asked alone.
#include "planning/edge_reaches.hpp"

#include "planning/contact_shape.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::planning {
namespace {

Eigen::Vector2d random_point(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> uniform(-half, half);
  return {uniform(random), uniform(random)};
}

/// A triangle at least, up to what a disc's margin makes.
Ring2 random_kernel(std::mt19937_64& random) {
  Ring2 points;
  while (convex_hull(points).size() < 3) points.push_back(random_point(random, 0.3));
  return random() % 2 == 0 ? convex_hull(points) : minkowski_sum(convex_hull(points), around_disc(0.1));
}

/// How deep inside of what an edge reaches a point of the line lies.
double depth(const ConvexLines& reach, const LineExtent& line, double t) {
  double least = HUGE_VAL;
  for (std::size_t side = 0; side < reach.corners.size(); ++side)
    least =
        std::min(least, reach.offsets[side] - reach.normals[side].dot(line.from + t * (line.to - line.from)));
  return least;
}

/// Of a chain of edges, its reaches being the first eight.
void expect_all_found(const EdgeReaches& reaches, const Ring2& kernel, const Ring2& chain,
                      const LineExtent& line) {
  const std::uint32_t near = reaches.near(0, line);
  EXPECT_EQ(near >> (chain.size() - 1), 0u);  // there is no edge
  for (std::uint32_t edge = 0; edge + 1 < chain.size(); ++edge) {
    Cut cut;
    const bool cuts = reaches.cut(edge, line, cut);
    EXPECT_TRUE((near >> edge & 1) != 0 || !cuts);
    const ConvexLines reach(minkowski_sum(kernel, {chain[edge], chain[edge + 1]}));
    EXPECT_TRUE(!cuts || depth(reach, line, (cut.in + cut.out) / 2) > -1e-12);
    for (const double t : {0.1, 0.5, 0.9})
      EXPECT_TRUE(depth(reach, line, t) < 1e-9 || (cuts && cut.in < t && t < cut.out));
  }
}

TEST(EdgeReaches, FindsAllThatAnEdgeCovers) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 300 && !HasFailure(); ++i) {
    const Ring2 kernel = random_kernel(random);
    EdgeReaches reaches;
    reaches.assign(ConvexLines(kernel), 1);
    Ring2 chain;
    for (std::size_t edges = 1 + random() % EdgeReaches::at_once; chain.size() <= edges;)
      chain.push_back(random_point(random, 1));
    reaches.set(0, chain);
    for (int k = 0; k < 20; ++k) {
      LineExtent line;
      reaches.measure(random_point(random, 1), random_point(random, 1), line);
      expect_all_found(reaches, kernel, chain, line);
    }
  }
}

}  // namespace
}  // namespace octosurf::planning
