// Sheets of points beside walls that are known, and planes through points of known noise.
#include "surfaces/criteria/soundness.hpp"

#include "support/map_state.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::surfaces {
namespace {

using Index = MapView::Index;

const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
const Eigen::Vector3d eye(1.5, 0.5, 0.5);

/// A wall of 1 m × 1 m at x = 1 mm, seen from +x, that is surface 1; and a sheet of points.
struct Wall {
  Wall() {
    const auto points = test::occupy(state, test::rectangle_scan(eye, {0.001, 0, 0}, y, z)).appeared;
    Ledger ledger(state);
    test::make_surface(ledger, points, {x, 0.001}, [](const Eigen::Vector3d&) { return true; });
  }

  /// What a sheet at `at` is said to lie over; points and plane as seen from `from`.
  SurfaceId sheet(const Eigen::Vector3d& corner, double width, double height, double facing = 1,
                  SurfaceId self = 0) {
    Scan scan = test::rectangle_scan({facing * 1.5, 0.5, 0.5}, corner, width * y, height * z);
    const auto points = test::occupy(state, scan).appeared;
    EXPECT_GT(points.size(), 100U);
    Ledger ledger(state);
    std::vector<Index> all;
    for (const occupancy::VoxelPoint& p : points) all.push_back(ledger.window.find(p.key));
    return noise_sheet_over(ledger, all, {facing * x, facing * corner.x()}, self);
  }

  MapState state{Parameters{}};
};

TEST(ParallelSheet, JustBehindALargerWall) { EXPECT_EQ(Wall().sheet({-0.009, 0.2, 0.2}, 0.5, 0.5), 1U); }

TEST(ParallelSheet, NotBesideIt) {
  EXPECT_EQ(Wall().sheet({-0.009, 1.05, 0.2}, 0.5, 0.5), 0U);
  EXPECT_EQ(Wall().sheet({-0.009, 0.8, 0.2}, 0.5, 0.5), 0U) << "two fifths of it lie over the wall";
}

TEST(ParallelSheet, NotBeyondTheReachOfNoise) { EXPECT_EQ(Wall().sheet({-0.059, 0.2, 0.2}, 0.5, 0.5), 0U); }

TEST(ParallelSheet, NotTheOtherSideOfAThinWall) {
  EXPECT_EQ(Wall().sheet({-0.009, 0.2, 0.2}, 0.5, 0.5, -1), 0U);
}

TEST(ParallelSheet, NotOverItselfNorOverALesserOne) {
  EXPECT_EQ(Wall().sheet({-0.009, 0.2, 0.2}, 0.5, 0.5, 1, 1), 0U);
  EXPECT_EQ(Wall().sheet({-0.009, -0.3, -0.3}, 1.6, 1.6), 0U) << "the sheet is the larger one";
}

TEST(Fitted, GoesThroughThePointsOnTheGivenSide) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> gauss(0, 0.003);
  Scan scan = test::rectangle_scan({80.5, 0.5, 1.5}, {80, 0, 0.011}, x, y);
  for (Eigen::Vector3f& p : scan.points) p.z() += static_cast<float>(gauss(rng));
  MapState state{Parameters{}};
  const auto points = test::occupy(state, scan).appeared;
  Ledger ledger(state);
  std::vector<Index> all;
  for (const occupancy::VoxelPoint& p : points) all.push_back(ledger.window.find(p.key));
  for (const double side : {-1.0, 1.0}) {
    const Plane toward{side * Eigen::Vector3d(0.1, 0.1, 0.99).normalized(), 0};
    const Plane plane = fitted(ledger, all, toward);
    EXPECT_NEAR(plane.normal.norm(), 1, 1e-9);
    // 2500 points of 3 mm and what rounding to 1/256 of a voxel leaves.
    EXPECT_GT(side * plane.normal.z(), std::cos(0.0015));
    EXPECT_NEAR(plane.signed_distance({80.5, 0.5, 0.011}), 0, 5e-4);
  }
}

}  // namespace
}  // namespace octosurf::surfaces
