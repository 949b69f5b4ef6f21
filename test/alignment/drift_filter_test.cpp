#include "alignment/drift_filter.hpp"

#include "alignment/pose_fit.hpp"
#include "alignment/surfaces_by_hand.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace octosurf::test {
namespace {

constexpr double noise_m = 0.001, noise_rad = 0.0005, least_m = 0.002, unnoticed_m = 0.01;

/// Where a robot is that walks in a circle.
Eigen::Isometry3d pose_at(int i) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = T.linear() * Eigen::Vector3d(3, 0, 1);
  return T;
}

/// What a scan at `truth` measures.
alignment::PoseMeasurement measured(const Eigen::Isometry3d& truth, std::mt19937_64& rng, double factor = 1) {
  std::normal_distribution<double> gauss(0, factor);
  Twist error;
  for (int i = 0; i < 6; ++i) error[i] = gauss(rng) * (i < 3 ? noise_rad : noise_m);
  alignment::PoseMeasurement measurement;
  measurement.T_map_sensor = octosurf::alignment::moved(truth, error);
  measurement.directions = TwistCovariance::Identity();
  measurement.motions = TwistCovariance::Identity();
  measurement.least_m = least_m;
  measurement.variances.resize(6);
  measurement.variances << Eigen::Vector3d::Constant(noise_rad * noise_rad),
      Eigen::Vector3d::Constant(noise_m * noise_m);
  return measurement;
}

double error_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

TEST(DriftFilter, ExactPosesStayBitForBit) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  for (int i = 0; i < 300; ++i) {
    alignment::DriftFilter filter(state, unnoticed_m);
    const alignment::PoseMeasurement m = measured(pose_at(i), rng);
    ASSERT_EQ(filter.update(pose_at(i), &m).matrix(), pose_at(i).matrix()) << "scan " << i;
    ASSERT_FALSE(filter.drifts());
  }
}

TEST(DriftFilter, MeasurementsThatAreWorseThanTheySayDoNotCount) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  for (int i = 0; i < 300; ++i) {
    const alignment::PoseMeasurement m = measured(pose_at(i), rng, 3);
    alignment::DriftFilter filter(state, unnoticed_m);
    ASSERT_EQ(filter.update(pose_at(i), &m).matrix(), pose_at(i).matrix()) << "scan " << i;
  }
  EXPECT_GT(alignment::DriftFilter(state, unnoticed_m).factor(), 1);
}

TEST(DriftFilter, AnErrorThatAllScansShareIsNoDrift) {
  // A robot that stands still sees the same surfaces again and again, and their errors: each measurement says
  // the same, off by what one of them may be off.
  surfaces::AlignmentState state;
  const Eigen::Isometry3d T = pose_at(0);
  alignment::PoseMeasurement m;
  m.directions = TwistCovariance::Identity();
  m.motions = TwistCovariance::Identity();
  m.least_m = least_m;
  m.variances.resize(6);
  m.variances << Eigen::Vector3d::Constant(noise_rad * noise_rad),
      Eigen::Vector3d::Constant(4 * noise_m * noise_m);
  Twist error = Twist::Zero();
  error[5] = 3 * noise_m;  // 1.5 standard deviations, more than least_m
  m.T_map_sensor = octosurf::alignment::moved(T, error);
  for (int i = 0; i < 300; ++i) {
    alignment::DriftFilter filter(state, unnoticed_m);
    ASSERT_EQ(filter.update(T, &m).matrix(), T.matrix()) << "scan " << i;
  }
}

TEST(DriftFilter, FollowsADriftAndSaysHowWell) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  double worst = 0, given = 0;
  for (int i = 0; i < 200; ++i) {
    // Half a millimetre a scan in one direction, and a turn about the vertical: of odometry.
    const Eigen::Isometry3d drift =
        Eigen::Translation3d(0.0005 * i, 0, 0) * Eigen::AngleAxisd(0.0001 * i, Eigen::Vector3d::UnitZ());
    const Eigen::Isometry3d T_given = drift * pose_at(i);
    const alignment::PoseMeasurement m = measured(pose_at(i), rng);
    const Eigen::Isometry3d used = alignment::DriftFilter(state, unnoticed_m).update(T_given, &m);
    if (i < 100) continue;
    worst = std::max(worst, error_m(used, pose_at(i)));
    given = std::max(given, error_m(T_given, pose_at(i)));
  }
  EXPECT_TRUE(alignment::DriftFilter(state, unnoticed_m).drifts());
  EXPECT_GT(given, 0.09);
  // A measurement is off by 1.7 mm (three directions of 1 mm); following half a millimetre a scan costs some
  // lag.
  EXPECT_LT(worst, 0.008);
}

TEST(DriftFilter, IsNotBelievedInWhereTheGivenPosesExplainTheScansAsWell) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  const auto given = [](int i) -> Eigen::Isometry3d {
    return Eigen::Translation3d(0.0005 * i, 0, 0) * pose_at(i);
  };
  int called = 0;
  for (int i = 0; i < 100; ++i) {
    alignment::PoseMeasurement m = measured(pose_at(i), rng);
    m.contradicts_given = [&] { return ++called < 0; };
    ASSERT_EQ(alignment::DriftFilter(state, unnoticed_m).update(given(i), &m).matrix(), given(i).matrix())
        << "scan " << i;
  }
  EXPECT_GT(called, 0);
  alignment::PoseMeasurement m = measured(pose_at(100), rng);
  m.contradicts_given = [] { return true; };
  alignment::DriftFilter(state, unnoticed_m).update(given(100), &m);
  EXPECT_TRUE(alignment::DriftFilter(state, unnoticed_m).drifts()) << "nothing else was missing";
}

/// Along x of the map or of the sensor, and a turn about the vertical: what each scan adds to the given
/// poses.
Twist steady_drift() {
  Twist twist = Twist::Zero();
  twist[2] = 0.0001;
  twist[3] = 0.0005;
  return twist;
}

/// Dead reckoning with a bias: every step is off by the same motion in the sensor's own axes.
std::vector<Eigen::Isometry3d> by_biased_odometry(int scans) {
  std::vector<Eigen::Isometry3d> given{pose_at(0)};
  const Eigen::Isometry3d bias = alignment::moved(Eigen::Isometry3d::Identity(), steady_drift());
  for (int i = 1; i < scans; ++i)
    given.push_back(given.back() * (pose_at(i - 1).inverse() * pose_at(i)) * bias);
  return given;
}

/// A frame that creeps and turns about the map's origin.
std::vector<Eigen::Isometry3d> in_a_creeping_frame(int scans) {
  std::vector<Eigen::Isometry3d> given;
  for (int i = 0; i < scans; ++i)
    given.push_back(alignment::moved(Eigen::Isometry3d::Identity(), i * steady_drift()) * pose_at(i));
  return given;
}

/// Every step is off by chance.
std::vector<Eigen::Isometry3d> by_a_walk(int scans, double step_m, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, step_m);
  std::vector<Eigen::Isometry3d> given;
  Eigen::Vector3d off = Eigen::Vector3d::Zero();
  for (int i = 0; i < scans; ++i) {
    given.push_back(Eigen::Translation3d(off) * pose_at(i));
    off += Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng));
  }
  return given;
}

/// How far the used poses are off, in the map's axes.
std::vector<Twist> errors_of(const std::vector<Eigen::Isometry3d>& given, std::mt19937_64& rng) {
  surfaces::AlignmentState state;
  std::vector<Twist> errors;
  for (int i = 0; i < static_cast<int>(given.size()); ++i) {
    const alignment::PoseMeasurement m = measured(pose_at(i), rng);
    const Eigen::Isometry3d used =
        alignment::DriftFilter(state, unnoticed_m).update(given[static_cast<std::size_t>(i)], &m);
    errors.push_back(alignment::twist_between(pose_at(i), used));
  }
  return errors;
}

// A filter that takes a steady drift for a walk lags by what it adds over the scans that it averages.
constexpr int long_way = 1000, settled = 100;

TEST(DriftFilter, ASteadyDriftOfTheFrameIsFollowedWithoutLag) {
  auto rng = test::rng();
  const std::vector<Twist> errors = errors_of(in_a_creeping_frame(long_way), rng);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = settled; i < errors.size(); ++i) mean += errors[i].tail<3>() / (long_way - settled);
  EXPECT_LT(mean.norm(), noise_m / 3);
}

TEST(DriftFilter, ABiasOfTheOdometryIsFollowedWithoutLag) {
  auto rng = test::rng();
  const std::vector<Twist> errors = errors_of(by_biased_odometry(long_way), rng);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // in the sensor's axes
  for (int i = settled; i < long_way; ++i)
    mean += pose_at(i).linear().transpose() * errors[static_cast<std::size_t>(i)].tail<3>() /
            (long_way - settled);
  EXPECT_LT(mean.norm(), noise_m / 3);
}

// An odometry errs by what it moves: while the robot stands in front of what the map does not know, nothing
// is added, and what was learned of the bias holds where it goes on.
TEST(DriftFilter, ASteadyDriftWaitsWhileTheRobotStands) {
  auto rng = test::rng();
  constexpr int measured_scans = 300, blind_scans = 50;
  const std::vector<Eigen::Isometry3d> given = by_biased_odometry(measured_scans + blind_scans);
  surfaces::AlignmentState state;
  const auto used = [&](int i, bool sees) {
    const alignment::PoseMeasurement m = measured(pose_at(i), rng);
    return alignment::DriftFilter(state, unnoticed_m)
        .update(given[static_cast<std::size_t>(i)], sees ? &m : nullptr);
  };
  Eigen::Isometry3d last = Eigen::Isometry3d::Identity();
  for (int i = 0; i < measured_scans; ++i) last = used(i, true);
  for (int i = 0; i < 200; ++i)
    ASSERT_LT(error_m(used(measured_scans - 1, false), last), 1e-9) << "scan " << i;
  const int end = measured_scans + blind_scans - 1;
  Eigen::Isometry3d after = last;
  for (int i = measured_scans; i <= end; ++i) after = used(i, false);
  const Eigen::Isometry3d as_given = last * given[measured_scans - 1].inverse() * given[end];
  EXPECT_LT(error_m(after, pose_at(end)), error_m(as_given, pose_at(end)) / 2);
}

TEST(DriftFilter, AWalkIsFollowedBetterThanItIsMeasured) {
  auto rng = test::rng();
  const std::vector<Twist> errors = errors_of(by_a_walk(long_way, noise_m / 2, rng), rng);
  double squares = 0;
  for (std::size_t i = settled; i < errors.size(); ++i)
    squares += errors[i].tail<3>().squaredNorm() / static_cast<double>(3 * (errors.size() - settled));
  EXPECT_LT(squares, noise_m * noise_m);
}

TEST(DriftFilter, ADriftThatEndsIsNotCarriedOn) {
  auto rng = test::rng();
  std::vector<Eigen::Isometry3d> given = in_a_creeping_frame(150);
  const Eigen::Isometry3d slid = given.back() * pose_at(149).inverse();
  for (int i = 150; i < 250; ++i) given.push_back(slid * pose_at(i));
  const std::vector<Twist> errors = errors_of(given, rng);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 200; i < errors.size(); ++i) mean += errors[i].tail<3>() / 50;
  EXPECT_LT(mean.norm(), noise_m);  // 0.25 mm by the measurements' own noise
}

TEST(DriftFilter, ADirectionThatNothingMeasuresStaysAsGiven) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  for (int i = 0; i < 150; ++i) {
    Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
    truth.translation() << 0.2 * i, 0, 1;
    const Eigen::Isometry3d T_given =
        Eigen::Translation3d(0.002 * i, 0.0008 * i, 0) * truth;  // along and across
    alignment::PoseMeasurement m = measured(truth, rng);
    const Eigen::Matrix<double, 5, 6> without_x =
        (Eigen::Matrix<double, 5, 6>() << TwistCovariance::Identity().topRows<3>(),
         TwistCovariance::Identity().bottomRows<2>())
            .finished();
    m.directions = without_x;
    m.motions = without_x.transpose();
    m.variances = (without_x * m.variances).eval();
    const Eigen::Isometry3d used = alignment::DriftFilter(state, unnoticed_m).update(T_given, &m);
    if (i < 60) continue;
    // Half a voxel of 2 cm, of the 12 cm that it would come to: the sensor's own bias might explain as much.
    EXPECT_LT(std::fabs(used.translation().y() - truth.translation().y()), 0.01);
    EXPECT_NEAR(used.translation().x(), T_given.translation().x(), 0.002) << "the corridor's own direction";
  }
}

// For a thousand scans nothing tells where they lie along the floor; then a few say that they are off by more
// and more, along directions that are nearly the same. Where those cross, a drift that had gone on all the
// time might be, decimetres away.
TEST(DriftFilter, ADriftThatBeginsHasTakenThePosesNoFarther) {
  auto rng = test::rng();
  std::normal_distribution<double> gauss(0, 1);
  surfaces::AlignmentState state;
  const Eigen::Isometry3d T = pose_at(0);
  Eigen::Matrix<double, 3, 6> of_floor = Eigen::Matrix<double, 3, 6>::Zero();
  of_floor(0, 0) = of_floor(1, 1) = of_floor(2, 5) = 1;
  for (int i = 0; i < 1000; ++i) {
    alignment::PoseMeasurement m = measured(T, rng);
    m.directions = of_floor;
    m.motions = of_floor.transpose();
    m.variances = (of_floor * m.variances).eval();
    alignment::DriftFilter(state, unnoticed_m).update(T, &m);
  }
  Eigen::Isometry3d used = T;
  for (int i = 0; i < 4; ++i) {
    alignment::PoseMeasurement m = measured(T, rng);
    const double turn = 0.04 * i;
    Eigen::Matrix<double, 4, 6> seen;
    seen << of_floor, 0, 0, 0, std::cos(turn), std::sin(turn), 0;
    m.T_map_sensor.translation() += (0.02 + 0.01 * i) * seen.row(3).tail<3>().transpose();
    m.directions = seen;
    m.motions = seen.transpose();
    m.variances = (seen * m.variances).eval();
    used = alignment::DriftFilter(state, unnoticed_m).update(T, &m);
  }
  ASSERT_TRUE(alignment::DriftFilter(state, unnoticed_m).drifts());
  EXPECT_LT(error_m(used, T), 0.05 + 2 * unnoticed_m) << "5 cm is the most that any scan said";
}

TEST(DriftFilter, AJumpThatStaysIsTakenOver) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  const Eigen::Isometry3d slip(Eigen::Translation3d(0.2, -0.1, 0));
  for (int i = 0; i < 50; ++i) {
    const alignment::PoseMeasurement m = measured(pose_at(i), rng);
    alignment::DriftFilter(state, unnoticed_m).update(pose_at(i), &m);
  }
  alignment::DriftFilter(state, unnoticed_m).jump(slip.inverse());
  const Eigen::Isometry3d T_given = slip * pose_at(50);
  EXPECT_LT(error_m(alignment::DriftFilter(state, unnoticed_m).expected(T_given), pose_at(50)), 1e-9);
}

TEST(DriftFilter, WhatItsErrorsMayHaveDoneIsNoJump) {
  auto rng = test::rng();
  const auto after = [&](double factor) {
    surfaces::AlignmentState state;
    for (int i = 0; i < 100; ++i) {
      const alignment::PoseMeasurement m = measured(pose_at(i), rng, factor);
      alignment::DriftFilter(state, unnoticed_m).update(pose_at(i), &m);
    }
    return state;
  };
  surfaces::AlignmentState as_stated = after(1), worse = after(5);
  const auto may_lie = [&](surfaces::AlignmentState& state, double off_m) {
    alignment::PoseMeasurement m = measured(pose_at(100), rng);
    m.T_map_sensor.translation().x() += off_m;
    return alignment::DriftFilter(state, unnoticed_m).may_lie(pose_at(100), m);
  };
  EXPECT_TRUE(may_lie(as_stated, 0));
  EXPECT_FALSE(may_lie(as_stated, 0.1));
  EXPECT_TRUE(may_lie(worse, 0.1))
      << "a hundred times the error that is stated, twenty times the one that is";
  EXPECT_FALSE(may_lie(worse, 0.5));
}

TEST(DriftFilter, OneWildMeasurementMovesLittle) {
  auto rng = test::rng();
  surfaces::AlignmentState state;
  for (int i = 0; i < 100; ++i) {
    alignment::PoseMeasurement m = measured(pose_at(i), rng);
    if (i == 50) m.T_map_sensor = octosurf::alignment::moved(m.T_map_sensor, any_twist(rng, 0.05, 0.01));
    const Eigen::Isometry3d used = alignment::DriftFilter(state, unnoticed_m).update(pose_at(i), &m);
    EXPECT_LT(error_m(used, pose_at(i)), 0.005) << i;
  }
}

}  // namespace
}  // namespace octosurf::test
