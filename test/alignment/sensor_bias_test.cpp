// What a sensor errs by throughout a recording, out of the corrections of its poses.
#include "alignment/sensor_bias.hpp"

#include "alignment/pose_fit.hpp"
#include "alignment/surfaces_by_hand.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

constexpr double degree = std::numbers::pi / 180;

Eigen::Isometry3d rotated(const Eigen::Isometry3d& pose, const Eigen::Vector3d& rotation) {
  Twist twist = Twist::Zero();
  twist.head<3>() = pose.linear() * rotation;
  return octosurf::alignment::moved(pose, twist);
}

struct Bias {
  Eigen::Vector3d tilt = Eigen::Vector3d::Zero();
  double scale = 0;
};

Eigen::Isometry3d on_a_circle(int i) {
  const double turn = 0.3 * i;
  const Eigen::Vector3d eye(1.5 * std::cos(turn), 1.5 * std::sin(turn), 1.3 + 0.2 * std::sin(0.7 * turn));
  return look_at(eye, {4 * std::cos(turn + 1), 4 * std::sin(turn + 1), 0.3});
}

/// Alignment as it is in a room that was mapped from the first pose: the whole map has that pose's error.
Alignment measured(const Eigen::Isometry3d& T_given, const Bias& bias, std::mt19937_64& rng) {
  const Eigen::Isometry3d first = on_a_circle(0);
  const Eigen::Isometry3d T_first_sensor = rotated(first, bias.tilt).inverse() * rotated(T_given, bias.tilt);
  Eigen::Isometry3d scaled = T_first_sensor;
  scaled.translation() *= 1 + bias.scale;
  Alignment alignment;
  alignment.outcome = AlignmentOutcome::corrected;
  alignment.determined = 6;
  const double sigma = 0.0005;
  alignment.covariance = sigma * sigma * TwistCovariance::Identity();
  std::normal_distribution<double> noise(0, sigma);
  Twist error;
  for (double& e : error) e = noise(rng);
  alignment.T_map_sensor = octosurf::alignment::moved(first * scaled, error);
  alignment.disagreement = alignment::twist_between(T_given, alignment.T_map_sensor);
  return alignment;
}

TEST(SensorBias, IsFoundInCorrectionsThatTurnWithTheSensor) {
  auto rng = test::rng();
  const Bias bias{Eigen::Vector3d(0.8, -0.4, 0.5) * degree, 0.015};
  alignment::SensorBiasEstimator estimator;
  for (int i = 0; i < 60; ++i)
    estimator.add(on_a_circle(i), measured(on_a_circle(i), bias, rng), i < 1 ? 1 : 0);
  EXPECT_EQ(estimator.views(), 60U);
  const auto found = estimator.estimate();
  ASSERT_TRUE(found.has_value());
  // Sixty scans of half a milliradian and half a millimetre each. The linear model leaves the product of two
  // rotations out: of 1° and some 30°'s change a per cent.
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(found->tilt_rad[axis], bias.tilt[axis],
                5 * std::sqrt(found->covariance(axis, axis)) + 0.03 * degree);
  EXPECT_NEAR(found->range_scale, bias.scale, 5 * std::sqrt(found->covariance(3, 3)) + 3e-4);
  EXPECT_LT(std::sqrt(found->covariance(3, 3)), 1e-3);
  EXPECT_LT(std::sqrt(found->covariance.topLeftCorner<3, 3>().trace()), 0.1 * degree);
}

TEST(SensorBias, ATiltAboutTheOnlyAxisTurnedAboutStaysUnknown) {
  auto rng = test::rng();
  alignment::SensorBiasEstimator estimator;
  for (int i = 0; i < 60; ++i) {  // about its own z, on the spot
    Eigen::Isometry3d given = Eigen::Isometry3d::Identity();
    given.rotate(Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitZ()));
    Alignment alignment = measured(given, {}, rng);
    alignment.T_map_sensor = given;
    alignment.disagreement.setZero();
    estimator.add(given, alignment, i < 1 ? 1 : 0);
  }
  const auto found = estimator.estimate();
  ASSERT_TRUE(found.has_value());
  EXPECT_GT(std::sqrt(found->covariance(2, 2)), 1 * degree);
  EXPECT_LT(std::sqrt(found->covariance(0, 0)), 0.1 * degree);
  EXPECT_GT(std::sqrt(found->covariance(3, 3)), 0.05);  // it never moved
}

TEST(SensorBias, AsksForEnoughViews) {
  auto rng = test::rng();
  alignment::SensorBiasEstimator estimator;
  EXPECT_FALSE(estimator.estimate().has_value());
  // Standing still shows nothing else.
  for (int i = 0; i < 100; ++i) estimator.add(on_a_circle(0), measured(on_a_circle(0), {}, rng), 0);
  EXPECT_EQ(estimator.views(), 1U);
  EXPECT_FALSE(estimator.estimate().has_value());
}

/// What a mapper's reports of two laps about the room come to.
alignment::SensorBias of_a_walk(const Bias& bias) {
  auto rng = test::rng();
  Parameters parameters;
  parameters.occupancy.resolution = 0.04;
  Mapper mapper(parameters);
  alignment::SensorBiasEstimator estimator;
  const int lap = 48;
  for (int i = 0; i < 2 * lap; ++i) {
    const double turn = 2 * std::numbers::pi * i / lap;
    const Eigen::Vector3d eye =
        middle_of_room + Eigen::Vector3d(0.8 * std::cos(turn), 1.0 * std::sin(turn), 0.2);
    const Eigen::Vector3d ahead(2 * std::cos(turn + 0.6), 2.5 * std::sin(turn + 0.6), -0.7);
    Scan scan = camera_scan(furnished_room(), look_at(eye, middle_of_room + ahead), rng,
                            {.width = 160, .height = 120, .focal = 110, .noise = 0.003});
    for (Eigen::Vector3f& point : scan.points) point *= static_cast<float>(1 + bias.scale);
    scan.T_map_sensor = rotated(scan.T_map_sensor, -bias.tilt);
    const ScanReport report = mapper.insert(scan);
    estimator.add(
        scan.T_map_sensor, report.alignment,
        static_cast<double>(report.appeared) / static_cast<double>(std::max<std::size_t>(1, report.voxels)));
  }
  return estimator.estimate().value_or(alignment::SensorBias{});
}

TEST(SensorBias, OfAWalkWithoutOneIsNone) {
  const alignment::SensorBias found = of_a_walk({});
  EXPECT_LT(found.tilt_rad.norm(), 0.1 * degree);
  EXPECT_LT(std::fabs(found.range_scale), 0.002);
  EXPECT_GT(found.covariance.trace(), 0);
}

TEST(SensorBias, OfAWalkWithATiltIsThatTiltOrLess) {
  // About the camera's x: it looks down by a degree more than its poses say.
  const alignment::SensorBias found = of_a_walk({Eigen::Vector3d(1, 0, 0) * degree, 0});
  EXPECT_GT(found.tilt_rad.x(), 0.5 * degree);
  EXPECT_LT(found.tilt_rad.x(), 1.2 * degree);
  EXPECT_LT(found.tilt_rad.tail<2>().norm(), 0.3 * degree);
}

}  // namespace
}  // namespace octosurf::test
