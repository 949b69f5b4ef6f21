#include "detection/detection.hpp"

#include "support/map_state.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace octosurf::detection {
namespace {

const Eigen::Vector3d eye(0.5, 0.5, 1.5);

void wait_for_detection(surfaces::MapState& state, const std::vector<occupancy::VoxelPoint>& points) {
  for (const occupancy::VoxelPoint& p : points) state.accumulated.push_back(p.key);
  std::sort(state.accumulated.begin(), state.accumulated.end());
}

/// A map with scans in its octree, all their points waiting.
struct Pending : surfaces::MapState {
  explicit Pending(const std::vector<Scan>& seen, const Parameters& wanted = {})
      : surfaces::MapState(wanted) {
    for (const Scan& scan : seen) wait_for_detection(*this, test::occupy(*this, scan).appeared);
  }
};

Scan piece(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
           double noise = 0, std::uint64_t seed = test::seed()) {
  Scan scan = test::rectangle_scan(eye, corner, u, v);
  std::mt19937_64 rng(seed);
  std::normal_distribution<float> gauss(0, 1);
  for (Eigen::Vector3f& p : scan.points) p *= 1 + static_cast<float>(noise) * gauss(rng) / p.norm();
  return scan;
}

std::vector<const surfaces::SurfaceModel*> found(surfaces::MapState& state) {
  surfaces::Ledger ledger(state);
  std::vector<const surfaces::SurfaceModel*> surfaces;
  if (const std::optional<Detection> detection = detect(ledger, state.accumulated)) {
    state.accumulated.clear();
    for (const SurfaceId id : detection->born) surfaces.push_back(state.surfaces.find(id));
  }
  // Nothing is lost: octree and surfaces agree.
  std::size_t owned = 0, inliers = 0;
  state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) { owned += p.surface != 0; });
  for (const auto& [id, surface] : state.surfaces) inliers += surface.size();
  EXPECT_EQ(owned, inliers);
  for (const surfaces::SurfaceModel* s : surfaces)
    EXPECT_GE(s->size(), static_cast<std::size_t>(state.parameters.min_surface_points()));
  return surfaces;
}

double angle_to(const surfaces::SurfaceModel& s, const Eigen::Vector3d& normal) {
  return std::acos(std::clamp(s.plane().normal.dot(normal.normalized()), -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(Detect, FindsAPlaneOfAnyOrientation) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  for (int round = 0; round < 8; ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    const Eigen::Vector3d x = pose.linear().col(0), y = pose.linear().col(1), n = pose.linear().col(2);
    Pending state({test::rectangle_scan(pose.translation() + 1.5 * n, pose.translation() - 0.4 * x - 0.4 * y,
                                        0.8 * x, 0.8 * y)});
    const std::size_t points = state.points;
    const auto surfaces = found(state);
    ASSERT_EQ(surfaces.size(), 1U) << "round " << round;
    EXPECT_LT(angle_to(*surfaces[0], n), 1) << "toward the side it was seen from";
    EXPECT_NEAR(surfaces[0]->plane().signed_distance(pose.translation()), 0, 0.002);
    EXPECT_GE(surfaces[0]->size(), points * 9 / 10);
    EXPECT_TRUE(state.accumulated.empty());
  }
}

TEST(Detect, WaitsForEnoughPoints) {
  const Parameters parameters;
  const double side = 0.6 * std::sqrt(parameters.min_surface_points()) * parameters.occupancy.resolution;
  Pending state({piece({0, 0, 0.01}, {side, 0, 0}, {0, side, 0})});
  const std::size_t waiting = state.accumulated.size();
  ASSERT_LT(waiting, static_cast<std::size_t>(parameters.min_surface_points()));
  EXPECT_TRUE(found(state).empty());
  EXPECT_EQ(state.accumulated.size(), waiting) << "they go on waiting";
}

TEST(Detect, FindsWhatOlderPendingPointsComplete) {
  // One half has been looked at before and waits in the octree only; the other half is new.
  Pending state({piece({0, 0, 0.01}, {0.5, 0, 0}, {0, 1, 0})});
  state.accumulated.clear();
  wait_for_detection(state, test::occupy(state, piece({0.5, 0, 0.01}, {0.5, 0, 0}, {0, 1, 0})).appeared);
  const auto surfaces = found(state);
  ASSERT_EQ(surfaces.size(), 1U);
  EXPECT_GE(surfaces[0]->size(), state.points * 9 / 10);
}

TEST(Detect, TellsParallelPlanesApart) {
  Pending state({piece({0, 0, 0.01}, {0.5, 0, 0}, {0, 1, 0}), piece({0.5, 0, 0.11}, {0.5, 0, 0}, {0, 1, 0})});
  const auto surfaces = found(state);
  ASSERT_EQ(surfaces.size(), 2U);
  std::vector<double> heights{surfaces[0]->plane().offset, surfaces[1]->plane().offset};
  std::sort(heights.begin(), heights.end());
  EXPECT_NEAR(heights[0], 0.01, 0.003);
  EXPECT_NEAR(heights[1], 0.11, 0.003);
}

TEST(Detect, TellsTheSidesOfACornerApart) {
  Pending state({piece({0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}), piece({0, 0, 0.02}, {0, 1, 0}, {0, 0, 1}),
                 piece({0, 1, 0.02}, {1, 0, 0}, {0, 0, 1})});
  const auto surfaces = found(state);
  ASSERT_EQ(surfaces.size(), 3U);
  for (const Eigen::Vector3d& n :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0)})
    EXPECT_EQ(
        std::count_if(surfaces.begin(), surfaces.end(), [&](const auto* s) { return angle_to(*s, n) < 2; }),
        1);
}

TEST(Detect, GapsOverHDivideAPlane) {
  const double gap = 2 * Parameters{}.max_hole_size();
  Pending state(
      {piece({0, 0, 0.01}, {0.5, 0, 0}, {0, 1, 0}), piece({0.5 + gap, 0, 0.01}, {0.5, 0, 0}, {0, 1, 0})});
  EXPECT_EQ(found(state).size(), 2U);
}

TEST(Detect, StandsNoise) {
  const std::uint64_t seed = test::seed();
  for (int round = 0; round < 4; ++round) {
    Pending state(
        {piece({0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}, 0.005, seed + static_cast<std::uint64_t>(round))});
    const auto surfaces = found(state);
    ASSERT_EQ(surfaces.size(), 1U);
    EXPECT_LT(angle_to(*surfaces[0], Eigen::Vector3d::UnitZ()), 0.5);
    EXPECT_NEAR(surfaces[0]->plane().signed_distance({0.5, 0.5, 0.01}), 0, 0.003);
  }
}

TEST(Detect, LeavesNarrowStripsAlone) {
  // One strip, on either side of the parameter: its width alone decides.
  const Scan strip = piece({0, 0.005, 0.01}, {1.5, 0, 0}, {0, 0.03, 0});
  Parameters narrower, wider;
  narrower.surfaces.min_surface_width = 0.015;
  wider.surfaces.min_surface_width = 0.045;
  for (const bool wanted : {true, false}) {
    Pending state({strip}, wanted ? narrower : wider);
    ASSERT_GE(state.accumulated.size(), static_cast<std::size_t>(state.parameters.min_surface_points()));
    EXPECT_EQ(found(state).size(), wanted ? 1U : 0U);
  }
}

TEST(Detect, ScatteredPointsStayPending) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Scan scan;
  for (int i = 0; i < 1500; ++i) scan.points.emplace_back(uniform(rng), uniform(rng), 2 + uniform(rng));
  Pending state({scan});
  EXPECT_TRUE(found(state).empty());
  state.occupancy.for_each_point([](const occupancy::VoxelPoint& p) { EXPECT_EQ(p.surface, 0U); });
}

TEST(Detect, ACylinderHasNoFacets) {
  // A pillar of radius 0.25 m: with normals in use, a facet that bends is no plane.
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d(1.5, 0, 0.5);
  for (double z = 0; z < 1; z += 0.009)
    for (double a = -1.2; a < 1.2; a += 0.03)
      scan.points.push_back(
          (Eigen::Vector3d(0.25 * std::cos(a), 0.25 * std::sin(a), z) - scan.T_map_sensor.translation())
              .cast<float>());
  Pending state({scan});
  for (const surfaces::SurfaceModel* s : found(state))
    ADD_FAILURE() << s->size() << " of " << state.points << " points, rms " << s->rms();
}

TEST(Detect, WhatIsSeenThroughASurfaceIsItsNoise) {
  // A wall at x = 0 is known; readings 2 cm behind it can only be its own noise.
  Pending state({});
  const auto wall =
      test::occupy(state, test::rectangle_scan({1.5, 0.5, 0.5}, {0, 0, 0}, {0, 1, 0}, {0, 0, 1})).appeared;
  {
    surfaces::Ledger ledger(state);
    test::make_surface(ledger, wall, {Eigen::Vector3d::UnitX(), 0}, [](const auto&) { return true; });
  }
  const auto behind =
      test::occupy(state, test::rectangle_scan({1.5, 0.5, 0.5}, {-0.025, 0.2, 0.2}, {0, 0.6, 0}, {0, 0, 0.6}))
          .appeared;
  wait_for_detection(state, behind);
  EXPECT_TRUE(found(state).empty());
}

TEST(Detect, ThePaperPresetFindsPlanesToo) {
  Pending state({piece({0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}), piece({0, 0.3, 0.32}, {0.6, 0, 0}, {0, 0.6, 0})},
                Parameters::paper());
  const auto surfaces = found(state);
  ASSERT_GE(surfaces.size(), 2U);
  EXPECT_LT(angle_to(*surfaces[0], Eigen::Vector3d::UnitZ()), 3);
  EXPECT_LT(angle_to(*surfaces[1], Eigen::Vector3d::UnitZ()), 3);
}

TEST(Detect, DoesNotDependOnTheOrderOfPoints) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::vector<Scan> scans{piece({0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}, 0.003),
                          piece({0, 0, 0.02}, {0, 1, 0}, {0, 0, 1}, 0.003)};
  Pending a(scans);
  const auto of_a = found(a);
  for (Scan& scan : scans) std::shuffle(scan.points.begin(), scan.points.end(), rng);
  Pending b(scans);
  const auto of_b = found(b);
  ASSERT_EQ(of_a.size(), of_b.size());
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    EXPECT_LT(angle_to(*of_a[i], of_b[i]->plane().normal), 0.1);
    EXPECT_NEAR(static_cast<double>(of_a[i]->size()), static_cast<double>(of_b[i]->size()),
                0.01 * static_cast<double>(of_a[i]->size()));
  }
}

}  // namespace
}  // namespace octosurf::detection
