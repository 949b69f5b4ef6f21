// How a scan agrees with the map before it, and what a run of scans makes of it.
#include "alignment/recording_check.hpp"
#include "alignment/run_agreement.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

/// A room of 4 m × 5 m × 2.4 m about the origin, seen from `T` in 20,000 directions.
Scan seen_from(const Eigen::Isometry3d& T) {
  constexpr int rays = 20000;
  const Eigen::Vector3d half(2, 2.5, 1.2), at = T.translation();
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.T_map_sensor = T;
  for (int k = 0; k < rays; ++k) {  // Fibonacci's sphere
    const double z = 1 - (2 * k + 1.0) / rays, turn = 2 * std::numbers::pi * k / std::numbers::phi;
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d own(r * std::cos(turn), r * std::sin(turn), z), ray = T.linear() * own;
    double length = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      length = std::min(length,
                        (half[axis] - std::copysign(at[axis], ray[axis] * at[axis])) / std::fabs(ray[axis]));
    scan.points.push_back((length * own).cast<float>());
  }
  return scan;
}
Scan seen_from(const Eigen::Vector3d& at) { return seen_from(Eigen::Isometry3d(Eigen::Translation3d(at))); }

/// Ten scans a second of a sensor that walks about the room and turns.
std::vector<Scan> walk(int scans) {
  std::vector<Scan> all;
  for (int k = 0; k < scans; ++k) {
    const double t = k / 10.0;
    Eigen::Isometry3d T(
        Eigen::Translation3d(1.2 * std::sin(0.7 * t), 1.5 * std::cos(0.4 * t), 0.3 * std::sin(t)));
    T.rotate(Eigen::AngleAxisd(0.8 * t, Eigen::Vector3d::UnitZ()) *
             Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
    all.push_back(seen_from(T));
    all.back().stamp_s = 50 + t;
  }
  return all;
}

TEST(Agreement, IsOfWhatTheMapHeldBefore) {
  Parameters parameters;
  parameters.occupancy.resolution = 0.05;
  parameters.align = false;
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
alignment::RunAgreement run_of(const std::vector<double>& shares, double jump_m, std::size_t at) {
  alignment::RunAgreement run;
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
  const alignment::RunAgreement run = run_of(shares, 0.02, 0);
  EXPECT_FALSE(run.contradiction());
  EXPECT_EQ(run.median(), 0.98);
  EXPECT_EQ(run.least(), 0.85);
  EXPECT_FALSE(alignment::RunAgreement().contradiction());
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

TEST(RunAgreement, OfAJumpThatAlignmentMendsSaysWhatItMended) {
  alignment::RunAgreement run;
  Scan scan;
  Alignment alignment;
  for (int k = 0; k < 20; ++k) {
    scan.T_map_sensor.translation().x() += k == 10 ? 0.52 : 0.02;
    alignment.T_map_sensor = scan.T_map_sensor;
    if (k >= 10) alignment.T_map_sensor.translation().x() -= 0.5;
    alignment.outcome = k == 10   ? AlignmentOutcome::rejected
                        : k == 11 ? AlignmentOutcome::recovered
                                  : AlignmentOutcome::agrees;
    run.add(scan, {200, 0, 0}, alignment);
  }
  const auto jump = run.contradiction();
  ASSERT_TRUE(jump);
  EXPECT_EQ(jump->first, 10U);
  EXPECT_NEAR(jump->jump_m, 0.5, 1e-9);
  EXPECT_NEAR(jump->jump_rad, 0, 1e-9);
}

/// A scan that fits nowhere, half of it in free space and half behind walls; the octree is as before.
TEST(Agreement, LeavesOutAScanThatContradictsAllThatIsKnown) {
  for (const bool enabled : {true, false}) {
    Parameters parameters;
    parameters.occupancy.resolution = 0.05;
    parameters.align = enabled;
    Mapper mapper(parameters);
    const std::vector<Scan> scans = walk(12);
    for (const Scan& scan : scans) mapper.insert(scan);
    const std::size_t before = mapper.map().size().leaves;
    Scan wrong = scans.back();
    wrong.T_map_sensor = Eigen::Translation3d(1.1, 0.9, 0.5) *
                         Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized()) * wrong.T_map_sensor;
    const ScanReport report = mapper.insert(wrong);
    EXPECT_LT(report.agreement.share(), 0.5);
    if (!enabled) {
      EXPECT_EQ(report.alignment.outcome, AlignmentOutcome::off);
      EXPECT_GT(mapper.map().size().leaves, before);
    } else {
      EXPECT_EQ(report.alignment.outcome, AlignmentOutcome::rejected);
      EXPECT_EQ(mapper.map().size().leaves, before);
      EXPECT_EQ(mapper.insert(scans.back()).alignment.outcome, AlignmentOutcome::agrees);
    }
  }
}

using alignment::Meaning;
using alignment::RecordingCheck;

TEST(RecordingCheck, ShortRunsGainNothingByScansThatOtherTimesLeaveOut) {
  for (const int scans : {12, 16, 20}) {
    RecordingCheck check;
    for (const Scan& scan : walk(scans)) check.add(scan);
    EXPECT_FALSE(check.better_meaning()) << scans;
  }
}

TEST(RecordingCheck, FindsWhatWouldMendAConstantError) {
  struct Case {
    Meaning meaning;
    double value, within;
    std::function<void(std::vector<Scan>&)> harm;
  };
  const auto each = [](const std::function<void(Scan&)>& harm) {
    return [harm](std::vector<Scan>& scans) {
      for (Scan& scan : scans) harm(scan);
    };
  };
  const auto scaled = [&](const Eigen::Vector3f& factors) {
    return each([factors](Scan& scan) {
      for (Eigen::Vector3f& point : scan.points) point = point.cwiseProduct(factors);
    });
  };
  const Case cases[] = {
      {Meaning::as_given, 0, 0, [](std::vector<Scan>&) {}},
      {Meaning::late, 0.2, 0.03,  // of the poses
       [](std::vector<Scan>& scans) {
         for (std::size_t k = scans.size() - 1; k >= 2; --k)
           scans[k].T_map_sensor = scans[k - 2].T_map_sensor;
         scans.erase(scans.begin(), scans.begin() + 2);
       }},
      {Meaning::scale, 1.2, 0.05, scaled(Eigen::Vector3f::Constant(1.2F))},
      {Meaning::mirrored_y, 0, 0, scaled({1, -1, 1})},
      {Meaning::turned_x, 0.1, 0.02,
       each([](Scan& scan) { scan.T_map_sensor.rotate(Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitX())); })},
      {Meaning::inverse, 0, 0, each([](Scan& scan) { scan.T_map_sensor = scan.T_map_sensor.inverse(); })},
      {Meaning::as_given, 0, 0,  // a jump is no constant error
       [](std::vector<Scan>& scans) {
         for (std::size_t k = scans.size() / 2; k < scans.size(); ++k)
           scans[k].T_map_sensor.pretranslate(Eigen::Vector3d(0.5, 0.2, 0));
       }},
  };
  for (const Case& one : cases) {
    std::vector<Scan> scans = walk(60);
    one.harm(scans);
    RecordingCheck check;
    for (const Scan& scan : scans) check.add(scan);
    EXPECT_GE(check.views(), RecordingCheck::enough_views);
    const int name = static_cast<int>(one.meaning);
    EXPECT_EQ(check.better_form().value_or(Meaning::as_given),
              one.meaning == Meaning::inverse ? one.meaning : Meaning::as_given)
        << name;
    EXPECT_FALSE(check.better_scale()) << name;
    if (one.meaning == Meaning::inverse) continue;
    const auto found = check.better_meaning();
    ASSERT_EQ(found.has_value(), one.meaning != Meaning::as_given) << name;
    if (!found) continue;
    EXPECT_EQ(found->meaning, one.meaning);
    EXPECT_NEAR(found->value, one.value, one.within) << name;
    EXPECT_GT(found->share, found->as_given);
  }
}

TEST(RunAgreement, JudgesNoScanThatSawMostlyNewPlaces) {
  alignment::RunAgreement run;
  for (int k = 0; k < 5; ++k) run.add({}, {0, alignment::RunAgreement::fewest_compared - 1, 0});
  EXPECT_EQ(run.scans(), 0U);
  EXPECT_FALSE(run.contradiction());
}

}  // namespace
}  // namespace octosurf
