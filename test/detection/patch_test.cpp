#include "detection/patch.hpp"

#include "detection/patch_graph.hpp"
#include "geometry/plane_frame.hpp"
#include "sensing/reading_model.hpp"
#include "support/testing.hpp"

namespace octosurf::detection {
namespace {

struct Square {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double half = 0.1, sigma = 0.002;  // m
  int steps = 10;
};

/// Readings on a square lattice about the centre, with noise along the normal.
Patch patch_of(const Square& square, std::mt19937_64& rng) {
  std::normal_distribution<double> noise(0, square.sigma);
  const Eigen::Matrix3d axes = geometry::plane_axes(square.normal);
  Patch patch;
  patch.plane.normal = square.normal;
  patch.origin = square.centre + Eigen::Vector3d(0.03, -0.01, 0.02);
  for (int i = 0; i <= square.steps; ++i)
    for (int j = 0; j <= square.steps; ++j) {
      const Eigen::Vector3d at((2.0 * i / square.steps - 1) * square.half,
                               (2.0 * j / square.steps - 1) * square.half, noise(rng));
      patch.moments.add(square.centre + axes * at - patch.origin, 1 / (square.sigma * square.sigma));
      ++patch.readings;
      ++patch.hits;
    }
  patch.fit();
  return patch;
}

Eigen::Vector3d tilted(double rad) { return {std::sin(rad), 0, std::cos(rad)}; }

TEST(Patch, CovarianceIsThatOfReadingsPlusWhatTheyHaveInCommon) {
  std::mt19937_64 rng = test::rng();
  const Square square;
  const Patch patch = patch_of(square, rng);
  const Eigen::Matrix3d R = geometry::plane_axes(square.normal).transpose();
  const Heights heights = heights_over(patch, square.centre, R);
  // In the middle of a square offset and slopes are independent: w, w/l, w/l with w = 1/W + σ_pose².
  const double w = square.sigma * square.sigma / patch.readings +
                   sensing::ReadingModel::pose_sigma * sensing::ReadingModel::pose_sigma;
  const double l = square.half * square.half * (square.steps + 2) / (3.0 * square.steps);
  EXPECT_NEAR(heights.covariance(0, 0), w, 1e-3 * w);
  EXPECT_NEAR(heights.covariance(1, 1), w / l, 1e-3 * w / l);
  EXPECT_NEAR(heights.covariance(2, 2), w / l, 1e-3 * w / l);
}

TEST(Patch, HeightsErrAsTheirCovarianceSays) {
  std::mt19937_64 rng = test::rng();
  // Off the patch, where slopes count.
  const Square square{.centre = {1, 2, 3}, .normal = tilted(0.4), .sigma = 0.01};
  const Eigen::Matrix3d axes = geometry::plane_axes(square.normal), R = axes.transpose();
  const Eigen::Vector3d at = square.centre + axes * Eigen::Vector3d(0.2, -0.1, 0);
  constexpr int trials = 2000;
  double chi2 = 0;
  for (int k = 0; k < trials; ++k) {
    const Heights heights = heights_over(patch_of(square, rng), at, R);
    chi2 += heights.theta.dot(heights.covariance.inverse() * heights.theta) / trials;
  }
  // χ² of three has a mean of 3; here its share that is noise, without what readings have in common. The mean
  // of 2,000 scatters by √(6 / trials); six of these, and 5 % for total instead of plain least squares.
  const double W = 121 / (square.sigma * square.sigma);
  const double share = 1 / (1 + W * sensing::ReadingModel::pose_sigma * sensing::ReadingModel::pose_sigma);
  EXPECT_NEAR(chi2, 3 * share, share * (0.15 + 6 * std::sqrt(6.0 / trials)));
}

TEST(Patch, TakesAnotherAsIfItHadItsReadingsFromTheStart) {
  std::mt19937_64 rng = test::rng();
  Patch a = patch_of({.centre = {5, 0, 1}}, rng);
  const Patch b = patch_of({.centre = {5.2, 0, 1}}, rng);
  geometry::Moments both = a.moments;
  both.add(b.moments.shifted(a.origin - b.origin));
  const Plane expected = geometry::fitted_plane(both, a.origin, a.plane.normal);
  const double readings = a.readings + b.readings;
  a.take(b);
  EXPECT_EQ(a.readings, readings);
  EXPECT_NEAR((a.plane.normal - expected.normal).norm(), 0, 1e-12);
  EXPECT_NEAR(a.plane.offset, expected.offset, 1e-12);
}

TEST(LogSame, PartsOfOnePlaneAreOne) {
  std::mt19937_64 rng = test::rng();
  for (const double rad : {0.0, 0.7}) {
    const Eigen::Vector3d normal = tilted(rad), along = geometry::plane_axes(normal).col(0);
    const Patch a = patch_of({.normal = normal}, rng),
                b = patch_of({.centre = 0.2 * along, .normal = normal}, rng);
    const Eigen::Vector3d at = 0.1 * along;
    EXPECT_GT(log_same(a, b, at), 0);
    EXPECT_NEAR(log_same(a, b, at), log_same(b, a, at), 1e-9);
  }
}

TEST(LogSame, AStepOrAnEdgePartsTwo) {
  std::mt19937_64 rng = test::rng();
  const Patch floor = patch_of({}, rng);
  const Eigen::Vector3d at(0.1, 0, 0);
  EXPECT_LT(log_same(floor, patch_of({.centre = {0.2, 0, 0.02}}, rng), at), 0);
  // Tilted about the line on which they meet.
  const Eigen::Vector3d normal = tilted(0.2);
  const Eigen::Vector3d centre = at + 0.1 * Eigen::Vector3d(normal.z(), 0, -normal.x());
  EXPECT_LT(log_same(floor, patch_of({.centre = centre, .normal = normal}, rng), at), 0);
}

TEST(LogSame, MoreReadingsTellSmallerTiltsApart) {
  std::mt19937_64 rng = test::rng();
  const double rad = 0.03;
  const Eigen::Vector3d normal = tilted(rad);
  const auto apart = [&](double half, int steps) {
    const Eigen::Vector3d at(half, 0, 0), centre = at + half * Eigen::Vector3d(normal.z(), 0, -normal.x());
    return log_same(patch_of({.half = half, .steps = steps}, rng),
                    patch_of({.centre = centre, .normal = normal, .half = half, .steps = steps}, rng), at);
  };
  EXPECT_GT(apart(0.04, 4), 0);
  EXPECT_LT(apart(0.4, 40), 0);
}

TEST(LogSame, WhatARecordingShakesByIsNoStep) {
  std::mt19937_64 rng = test::rng();
  Patch floor = patch_of({}, rng), slab = patch_of({.centre = {0.2, 0, 0.012}}, rng);
  const Eigen::Vector3d at(0.1, 0, 0.006);
  EXPECT_LT(log_same(floor, slab, at), 0);
  floor.pose_variance = slab.pose_variance = 0.012 * 0.012;
  EXPECT_GT(log_same(floor, slab, at), 0);
}

/// Heights taken where the two meet say the same as heights taken once for the pair.
TEST(LogSame, DoesNotDependOnWhereHeightsAreTaken) {
  std::mt19937_64 rng = test::rng();
  const Patch a = patch_of({.centre = {3, 1, 2}}, rng),
              b = patch_of({.centre = {3.3, 1.1, 2.01}, .normal = tilted(0.1), .half = 0.05}, rng);
  const PlanePair pair(a, b);
  const Eigen::Matrix3d R = geometry::plane_axes((a.plane.normal + b.plane.normal).normalized()).transpose();
  const auto slow = [&](const Eigen::Vector3d& at) {  // but for what is the same everywhere
    const Heights ha = heights_over(a, at, R), hb = heights_over(b, at, R);
    const Eigen::Vector3d D = ha.theta - hb.theta;
    const Eigen::Matrix3d C = ha.covariance + hb.covariance;
    return -0.5 * (std::log(C.determinant()) + D.dot(C.inverse() * D)) +
           0.5 * std::log(D[0] * D[0] + C(0, 0));
  };
  const Eigen::Vector3d here(3.1, 1, 2), there(2.8, 1.4, 2.1);
  EXPECT_NEAR(pair.log_same(there) - pair.log_same(here), slow(there) - slow(here), 1e-6);
  EXPECT_GT(std::fabs(slow(there) - slow(here)), 0.1);
}

TEST(LogTail, NoiseBehindAWallIsTheWalls) {
  std::mt19937_64 rng = test::rng();
  Patch wall = patch_of({.half = 0.5, .sigma = 0.02, .steps = 50}, rng);
  wall.hits = 4 * wall.readings;
  const Patch tail = patch_of({.centre = {0, 0, -0.03}, .half = 0.1, .sigma = 0.02, .steps = 8}, rng);
  EXPECT_GT(log_tail(wall, tail), 0);
  const Patch board = patch_of({.centre = {0, 0, 0.15}, .half = 0.1, .sigma = 0.02, .steps = 8}, rng);
  EXPECT_LT(log_tail(wall, board), 0);
}

TEST(DescriptionCost, ExactPlanesCostMore) {
  std::mt19937_64 rng = test::rng();
  const double coarse = description_cost(patch_of({.sigma = 0.05}, rng));
  const double exact = description_cost(patch_of({.sigma = 0.001}, rng));
  EXPECT_GT(coarse, 0);
  EXPECT_GT(exact, coarse);
}

/// A level square of exact readings of 2 mm noise about (x, 0, z).
Patch level(double x, double z, double facing = 1) {
  Patch patch;
  patch.plane.normal = {0, 0, facing};
  patch.origin = {x, 0, z};
  for (int i = -5; i <= 5; ++i)
    for (int j = -5; j <= 5; ++j) {
      patch.moments.add({0.02 * i, 0.02 * j, 0}, 1 / (0.002 * 0.002));
      ++patch.readings;
      ++patch.hits;
      patch.log_peaks += 5;  // of 2 mm
    }
  patch.fit();
  return patch;
}

TEST(PatchGraph, JoinsAChainOfOnePlane) {
  PatchGraph graph({Patch(), level(0, 0), level(0.22, 0), level(0.44, 0), level(0.22, 0.3)});
  graph.meet(1, 2, {0.11, 0, 0}, 11);
  graph.meet(2, 3, {0.33, 0, 0}, 0);  // across a gap
  const PatchGraph::Merged merged = std::move(graph).merge();
  ASSERT_EQ(merged.patches.size(), 3U);
  EXPECT_EQ(merged.into[0], clutter);
  EXPECT_EQ(merged.into[1], merged.into[2]);
  EXPECT_EQ(merged.into[1], merged.into[3]);
  EXPECT_NE(merged.into[1], merged.into[4]);
  EXPECT_EQ(merged.patches[merged.into[1]].readings, 3 * 121);
}

TEST(PatchGraph, LeavesStepsAndBacksApartHoweverLongTheirRimAndWhatDoesNotMeet) {
  for (const double rim : {11.0, 10000.0}) {
    PatchGraph graph({Patch(), level(0, 0), level(0.22, 0.05), level(0, -0.002, -1), level(0.22, 0)});
    graph.meet(1, 2, {0.11, 0, 0.02}, rim);
    graph.meet(1, 3, {0, 0, 0}, 100);
    EXPECT_EQ(std::move(graph).merge().patches.size(), 5U);
  }
}

/// A chain of level squares and of squares a step higher, met in any order of labels.
std::vector<std::size_t> sizes_of_merged(const std::vector<std::size_t>& order) {
  std::vector<Patch> patches(1);
  std::vector<Label> label(order.size());
  for (const std::size_t k : order) {
    label[k] = static_cast<Label>(patches.size());
    patches.push_back(level(0.22 * static_cast<double>(k), k % 5 == 4 ? 0.05 : 0));
  }
  PatchGraph graph(std::move(patches));
  for (std::size_t k = 0; k + 1 < order.size(); ++k)
    for (std::size_t l = k + 1; l < std::min(order.size(), k + 3); ++l)
      graph.meet(label[k], label[l], {0.11 * static_cast<double>(k + l), 0, 0}, 11);
  const PatchGraph::Merged merged = std::move(graph).merge();
  std::vector<std::size_t> sizes;
  for (const Label l : label)
    sizes.push_back(static_cast<std::size_t>(merged.patches[merged.into[l]].readings));
  return sizes;
}

TEST(PatchGraph, OrderOfPatchesDoesNotMatter) {
  std::mt19937_64 rng = test::rng();
  std::vector<std::size_t> order(30);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::vector<std::size_t> expected = sizes_of_merged(order);
  EXPECT_EQ(expected[0], 24U * 121);  // all that are level, past the steps
  EXPECT_EQ(expected[4], 121U);
  for (int trial = 0; trial < 5; ++trial) {
    std::shuffle(order.begin(), order.end(), rng);
    EXPECT_EQ(sizes_of_merged(order), expected);
  }
}

}  // namespace
}  // namespace octosurf::detection
