// What a run says before it costs too much, from numbers that are known.
#include "run_forecast.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::uint64_t gigabyte = 1'000'000'000;

/// Of a lidar in the middle of a ball of this radius, with readings `step` radians apart.
Scan ball(double radius, double step) {
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.name = "ball";
  for (double elevation = -1.2; elevation < 1.2; elevation += step)
    for (double azimuth = 0; azimuth < 2 * std::numbers::pi; azimuth += step / std::cos(elevation))
      scan.points.push_back(
          (radius * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                    std::cos(elevation) * std::sin(azimuth), std::sin(elevation)))
              .cast<float>());
  return scan;
}

double advised(const std::string& text) {
  return std::stod(text.substr(text.find("--resolution ") + std::string("--resolution ").size()));
}

TEST(RunForecast, AScanThatDoesNotFitIsRefusedWithAResolutionThatDoes) {
  const Scan scan = ball(5, 0.02);  // 34,000 readings
  OccupancyParameters parameters;
  parameters.resolution = 0.02;
  EXPECT_NO_THROW(require_memory(scan, parameters, gigabyte));
  EXPECT_NO_THROW(require_memory(scan, parameters, 0)) << "what is left is not known";
  // 4/3 π 5³ m³ in cubes of 4 cm, whose rays lie closer than these up to 2 m and are alone from there on:
  // some 17 million cubes.
  parameters.resolution = 0.002;
  try {
    require_memory(scan, parameters, gigabyte);
    FAIL() << "no memory of this size holds it";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("ball: takes about "), HasSubstr("at 0.002 m"), HasSubstr("1 GB")));
    parameters.resolution = advised(error.hint());
    EXPECT_LT(parameters.resolution, 0.02);
    EXPECT_NO_THROW(require_memory(scan, parameters, gigabyte));
  }
}

TEST(RunForecast, WhatTheRestWillCostIsSaidAfterTheFirstScans) {
  const Scan scan = ball(5, 0.02);
  OccupancyParameters parameters;
  parameters.resolution = 0.02;
  FirstScans first{
      .count = 3, .left = 98, .scan_s = 0.5, .interval_s = 0.1, .bytes_first = 50e6, .bytes = 150e6};
  EXPECT_EQ(cost_warning(first, scan, parameters, 8 * gigabyte), "") << "4.9 GB";
  const std::string memory = cost_warning(first, scan, parameters, 4 * gigabyte);
  EXPECT_THAT(memory, AllOf(HasSubstr("grows by 0.05 GB a scan"), HasSubstr("98 more need 4.9 of 4 GB"),
                            HasSubstr("--max-memory")));
  EXPECT_GT(advised(memory), 0.02);
  EXPECT_EQ(cost_warning(first, scan, parameters, 0), "") << "within a limit, or not known";
  first.scan_s = 7.4;
  const std::string time = cost_warning(first, scan, parameters, 8 * gigabyte);
  EXPECT_THAT(time, AllOf(HasSubstr("a scan takes 7.4 s, 74 times the interval"),
                          HasSubstr("98 more take 12 minutes"), HasSubstr("meets 1/7 of the voxels")));
  first.interval_s = 8;
  EXPECT_EQ(cost_warning(first, scan, parameters, 8 * gigabyte), "") << "a slow recording";
}

TEST(RunForecast, ReadingsTooFarApartAreNamedWithAResolutionThatFindsSurfaces) {
  const Scan scan = ball(5, 0.02);  // 10 cm apart
  Parameters parameters;
  const std::string text = spacing_warning(scan, parameters);
  EXPECT_THAT(text, AllOf(HasSubstr("0.1 m apart"), HasSubstr("0.02 m")));
  parameters.occupancy.resolution = advised(text);
  EXPECT_EQ(spacing_warning(scan, parameters), "");
  EXPECT_EQ(spacing_warning(ball(5, 0.01), parameters), "");
}

}  // namespace
}  // namespace octosurf::test
