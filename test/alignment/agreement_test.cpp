// How a scan agrees with the map before it, and what a run of scans makes of it.
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

/// A room of 4 m × 5 m × 2.4 m about the origin, seen from `at` in 20,000 directions.
Scan seen_from(const Eigen::Vector3d& at) {
  constexpr int rays = 20000;
  const Eigen::Vector3d half(2, 2.5, 1.2);
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.T_map_sensor.translation() = at;
  for (int k = 0; k < rays; ++k) {  // Fibonacci's sphere
    const double z = 1 - (2 * k + 1.0) / rays, turn = 2 * std::numbers::pi * k / std::numbers::phi;
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d ray(r * std::cos(turn), r * std::sin(turn), z);
    double length = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      length = std::min(length,
                        (half[axis] - std::copysign(at[axis], ray[axis] * at[axis])) / std::fabs(ray[axis]));
    scan.points.push_back((length * ray).cast<float>());
  }
  return scan;
}

TEST(Agreement, IsOfWhatTheMapHeldBefore) {
  Parameters parameters;
  parameters.occupancy.resolution = 0.05;
  parameters.alignment.enabled = false;
  Mapper mapper(parameters);
  const Scan right = seen_from(Eigen::Vector3d::Zero());
  EXPECT_EQ(mapper.insert(right).agreement.compared(), 0U);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(mapper.insert(right).agreement.share(), 1) << k;
  Scan displaced = right;
  displaced.T_map_sensor.translation() = Eigen::Vector3d::Constant(0.5);
  const Agreement agreement = mapper.insert(displaced).agreement;
  // Three walls stand half a metre inside of the room, three behind those that are known; what is left are
  // strips.
  EXPECT_LT(agreement.share(), 0.4);
  EXPECT_GT(agreement.in_free_space, agreement.compared() / 5);
  EXPECT_GT(agreement.behind_matter, agreement.compared() / 5);
  EXPECT_EQ(mapper.insert(displaced).agreement.share(), 1);  // with both versions
}

/// Adds scans that move by 2 cm each, and jump by `jump_m` at scan `at`.
RunAgreement run_of(const std::vector<double>& shares, double jump_m, std::size_t at) {
  RunAgreement run;
  Scan scan;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    scan.T_map_sensor.translation().x() += k == at ? jump_m : 0.02;
    scan.stamp_s = static_cast<double>(k);
    const auto agrees = static_cast<std::size_t>(std::lround(200 * shares[k]));
    run.add(scan, {agrees, 200 - agrees, 0});
  }
  return run;
}

TEST(RunAgreement, ARightRunContradictsNothing) {
  std::vector<double> shares(30, 0.98);
  shares[7] = 0.85;  // somebody walks by
  const RunAgreement run = run_of(shares, 0.02, 0);
  EXPECT_FALSE(run.contradiction());
  EXPECT_EQ(run.median(), 0.98);
  EXPECT_EQ(run.least(), 0.85);
  EXPECT_FALSE(RunAgreement().contradiction());
}

TEST(RunAgreement, NamesAJumpAndTwoTracks) {
  std::vector<double> shares(30, 0.99);
  shares[12] = 0.4;
  const auto jump = run_of(shares, 0.3, 12).contradiction();
  ASSERT_TRUE(jump);
  EXPECT_EQ(jump->scans, 1U);
  EXPECT_EQ(jump->first, 12U);
  EXPECT_EQ(jump->stamp_s, 12);
  EXPECT_NEAR(jump->share, 0.4, 1e-9);
  EXPECT_NEAR(jump->jump_m, 0.3, 1e-9);
  EXPECT_FALSE(jump->alternates);
  for (std::size_t k = 12; k < shares.size(); k += 2) shares[k] = 0.5;
  const auto tracks = run_of(shares, 0.02, 12).contradiction();
  ASSERT_TRUE(tracks);
  EXPECT_TRUE(tracks->alternates);
  EXPECT_EQ(tracks->jump_m, 0);
}

TEST(RunAgreement, JudgesNoScanThatSawMostlyNewPlaces) {
  RunAgreement run;
  for (int k = 0; k < 5; ++k) run.add({}, {0, RunAgreement::fewest_compared - 1, 0});
  EXPECT_EQ(run.scans(), 0U);
  EXPECT_FALSE(run.contradiction());
}

}  // namespace
}  // namespace octosurf
