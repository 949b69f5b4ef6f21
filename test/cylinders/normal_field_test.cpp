#include "cylinders/normal_field.hpp"

#include "support/map_state.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::cylinders {
namespace {

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) * 180 / std::numbers::pi;
}

/// A square metre on z = 0 of `pose`, seen from 1.5 m above.
Scan square(const Eigen::Isometry3d& pose, double noise, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, 1);
  const Eigen::Vector3d x = pose.linear().col(0), y = pose.linear().col(1), n = pose.linear().col(2);
  Scan scan =
      test::rectangle_scan(pose.translation() + 1.5 * n, pose.translation() - 0.5 * x - 0.5 * y, x, y);
  for (Eigen::Vector3f& p : scan.points) p += (noise * gauss(rng) * n).cast<float>();
  return scan;
}

TEST(NormalField, FindsPlanesOfAnyOrientation) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  for (const double noise : {0.0, 0.004})
    for (int round = 0; round < 8; ++round) {
      Eigen::Isometry3d pose = test::random_pose(rng);
      if (round < 3) {  // exactly along the voxels
        pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round));
      }
      surfaces::MapState state{Parameters{}};
      const occupancy::OccupancyDelta delta = test::occupy(state, square(pose, noise, rng));
      const surfaces::Ledger ledger(state);
      const NormalField normals(ledger);
      std::size_t inner = 0, known = 0, wrong = 0;
      for (const occupancy::VoxelPoint& p : delta.appeared) {
        const Eigen::Vector3d at = pose.inverse() * Eigen::Vector3d(p.position.cast<double>());
        if (at.head<2>().cwiseAbs().maxCoeff() > 0.4) continue;
        ++inner;
        const LocalPlane plane = normals.at(ledger.window.find(p.key));
        known += plane.known;
        if (!plane.known) continue;
        EXPECT_NEAR(plane.normal.norm(), 1, 1e-5);
        EXPECT_GE(plane.normal.dot(p.view), 0) << "away from the viewer";
        wrong += degrees_between(plane.normal.cast<double>(), pose.linear().col(2)) > (noise > 0 ? 15 : 3);
      }
      ASSERT_GT(inner, 1000U);
      EXPECT_GE(known, inner * 99 / 100);
      EXPECT_LE(wrong, inner / (noise > 0 ? 50 : 200))
          << "of " << inner << ", round " << round << ", noise " << noise;
    }
}

TEST(NormalField, TwoSidesOfAThinBoardStayApart) {
  // Faces 3 cm apart, each seen from its own side; s and the radius reach over to the other one.
  surfaces::MapState state{Parameters{}};
  const Eigen::Vector3d y(0, 1, 0), z(0, 0, 1);
  test::occupy(state, test::rectangle_scan({1.5, 0.5, 0.5}, {0.015, 0, 0}, y, z));
  test::occupy(state, test::rectangle_scan({-1.5, 0.5, 0.5}, {-0.015, 0, 0}, y, z));
  const surfaces::Ledger ledger(state);
  const NormalField normals(ledger);
  std::size_t points = 0, wrong = 0;
  state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    if ((p.position.tail<2>() - Eigen::Vector2f(0.5F, 0.5F)).cwiseAbs().maxCoeff() > 0.4F) return;
    ++points;
    const LocalPlane plane = normals.at(ledger.window.find(p.key));
    const Eigen::Vector3d front = (p.position.x() > 0 ? 1 : -1) * Eigen::Vector3d::UnitX();
    wrong += !plane.known || degrees_between(plane.normal.cast<double>(), front) > 10;
  });
  EXPECT_GT(points, 2000U);
  EXPECT_LE(wrong, points / 100);
}

TEST(NormalField, AKnownTopDoesNotRoundTheEdgeBesideIt) {
  // A table's edge: its top at z = 0 for x < 0, its side at x = 0 below; both seen from outside.
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> gauss(0, 0.002);
  const Eigen::Vector3d y(0, 1, 0), z(0, 0, 1), eye(1.2, 0.5, 1.2);
  Scan top = test::rectangle_scan(eye, {-0.6, 0, 0.001}, 0.599 * Eigen::Vector3d::UnitX(), y);
  for (Eigen::Vector3f& p : top.points) p.z() += static_cast<float>(gauss(rng));
  Scan side = test::rectangle_scan(eye, {0.001, 0, -0.5}, y, 0.49 * z);
  for (Eigen::Vector3f& p : side.points) p.x() += static_cast<float>(gauss(rng));
  // Angles to the side's normal of the side's points just out of reach of the top's noise.
  const auto mean_angle = [&](bool top_is_known) {
    surfaces::MapState state{Parameters{}};
    const auto of_top = test::occupy(state, top).appeared;
    const auto of_side = test::occupy(state, side).appeared;
    const double s = state.parameters.surface_tolerance();
    if (top_is_known) {
      surfaces::Ledger ledger(state);
      test::make_surface(ledger, of_top, {z, 0.001}, [](const Eigen::Vector3d&) { return true; });
    }
    const surfaces::Ledger ledger(state);
    const NormalField normals(ledger);
    double sum = 0;
    int points = 0;
    for (const occupancy::VoxelPoint& p : of_side) {
      if (p.position.z() > -s - 0.003 || p.position.z() < -0.035F || p.position.y() < 0.2F ||
          p.position.y() > 0.8F)
        continue;
      const LocalPlane plane = normals.at(ledger.window.find(p.key));
      EXPECT_TRUE(plane.known);
      sum += degrees_between(plane.normal.cast<double>(), Eigen::Vector3d::UnitX());
      ++points;
    }
    EXPECT_GT(points, 20);
    return sum / points;
  };
  const double without = mean_angle(false), with = mean_angle(true);
  EXPECT_LT(with, 6) << "of its own points alone, as on any plane of such noise";
  EXPECT_GT(without, 2 * with) << "the top rounds the edge while nobody knows it";
}

TEST(NormalField, TooFewOrALineIsNotKnown) {
  surfaces::MapState state{Parameters{}};
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 1);
  scan.points.emplace_back(3, 3, -1);  // alone
  for (int i = 0; i < 100; ++i) scan.points.push_back({0.01F * static_cast<float>(i), 0, -1});
  test::occupy(state, scan);
  const surfaces::Ledger ledger(state);
  const NormalField normals(ledger);
  state.occupancy.for_each_point(
      [&](const occupancy::VoxelPoint& p) { EXPECT_FALSE(normals.at(ledger.window.find(p.key)).known); });
}

}  // namespace
}  // namespace octosurf::cylinders
