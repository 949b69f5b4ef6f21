// How sure published planes say they are, against the truth, after whole scans.
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <iostream>
#include <random>
#include <string>

#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

/// Slopes and offset of the true plane over the published one, in its frame.
Eigen::Vector3d error_of(const Surface& surface, const Plane& truth) {
  const Eigen::Vector3d n = surface.T_map_surface.linear().transpose() * truth.normal;
  return {-n.x() / n.z(), -n.y() / n.z(),
          -truth.signed_distance(surface.T_map_surface.translation()) / n.z()};
}

constexpr std::array<int, 3> looked_at{1, 4, 12};  // scans

/// A table of 0.6 by 0.4 m times `size`, seen from all around at `height` times `size` over it.
struct World {
  double noise = 0.002, size = 1, resolution = 0.02, height = 0.9, tip = 0.2;
};

/// Squared errors in units of what is said after 1, 4 and 12 scans, per direction: χ² of three, over three.
std::array<double, looked_at.size()> squared_errors(const World& world, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Eigen::Vector3d tip =
      Eigen::Vector3d(world.tip * uniform(rng), world.tip * uniform(rng), 1).normalized();
  const Eigen::Matrix3d R =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), tip).toRotationMatrix();
  const Eigen::Vector3d corner = 0.1 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
  test::Scene scene;
  scene.rectangle(corner, 0.6 * world.size * R.col(0), 0.4 * world.size * R.col(1));
  const Eigen::Vector3d middle = corner + 0.3 * world.size * R.col(0) + 0.2 * world.size * R.col(1);
  Parameters parameters;
  parameters.occupancy.resolution = world.resolution;
  Mapper mapper(parameters);
  test::Camera camera;
  camera.noise = world.noise;
  std::array<double, looked_at.size()> squares{};
  int scans = 0;
  for (std::size_t look = 0; look < looked_at.size(); ++look) {
    for (; scans < looked_at[look]; ++scans) {
      const Eigen::Vector3d eye =
          middle +
          world.size * Eigen::Vector3d(0.5 * std::cos(2 * scans), 0.5 * std::sin(2 * scans), world.height);
      mapper.insert(test::camera_scan(scene, test::look_at(eye, middle), rng, camera));
    }
    const auto snapshot = mapper.snapshot();
    EXPECT_EQ(snapshot->surfaces.size(), 1U);
    const Surface& table = *snapshot->surfaces.at(0);
    const Eigen::Vector3d error = error_of(table, {tip, tip.dot(corner)});
    squares[look] = error.dot(table.covariance.ldlt().solve(error)) / 3;
  }
  return squares;
}

/// How many worlds a property is asked in; OCTOSURF_TEST_WORLDS overrides it.
int worlds_or(int usual) {
  const char* given = std::getenv("OCTOSURF_TEST_WORLDS");
  return given != nullptr ? std::stoi(given) : usual;
}

/// Root mean square of the errors in units of what is said, after 1, 4 and 12 scans: 1 if it is true.
/// Over n worlds chance leaves it unsure by √(1/(6 n)).
std::array<double, looked_at.size()> errors_over_said(const World& world, int worlds, std::mt19937_64& rng) {
  std::array<double, looked_at.size()> ratios{};
  for (int i = 0; i < worlds; ++i) {
    const auto squares = squared_errors(world, rng);
    for (std::size_t look = 0; look < ratios.size(); ++look) ratios[look] += squares[look] / worlds;
  }
  std::cout << "noise " << 1e3 * world.noise << " mm, size " << world.size << ", d " << world.resolution
            << ", " << worlds << " worlds: after 1, 4, 12 scans errors are";
  for (double& ratio : ratios) std::cout << " " << (ratio = std::sqrt(ratio));
  std::cout << " times what is said\n";
  return ratios;
}

/// Within 15 %, as far as so many worlds can tell: four and a half deviations of chance, beyond which one run
/// in 100,000 falls. The 200 worlds that tell 15 % take minutes: OCTOSURF_TEST_WORLDS=200.
void expect_true(const World& world) {
  std::mt19937_64 rng(test::seed());
  const int worlds = worlds_or(40);
  const double slack = std::max(0.15, 4.5 * std::sqrt(1 / (6.0 * worlds)));
  for (const double ratio : errors_over_said(world, worlds, rng)) {
    EXPECT_GT(ratio, 1 - slack);
    EXPECT_LT(ratio, 1 + slack);
  }
}

TEST(Covariance, IsTrueOfWholeScans) { expect_true({}); }

TEST(Covariance, IsTrueOfALargeSurface) {
  World large;
  large.size = 2;
  expect_true(large);
}

/// What is further off than the tolerance, here two and a half deviations, is not read: on both sides alike.
TEST(Covariance, IsTrueWhereNoiseReachesTheTolerance) {
  World noisy;
  noisy.noise = 0.006;
  expect_true(noisy);
}

}  // namespace
}  // namespace octosurf
