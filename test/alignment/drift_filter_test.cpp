#include "alignment/drift_filter.hpp"

#include "alignment/surfaces_by_hand.hpp"

namespace octosurf::test {
namespace {

using alignment::DriftFilter;
using alignment::Revisit;
using alignment::SensorErrors;

constexpr double resolution = 0.02, lever_m = 2, noise_m = 0.0005;

/// Where a robot is that walks in a circle: a quarter of a metre and 5° from scan to scan.
Eigen::Isometry3d pose_at(int i) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.085 * i, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = T.linear() * Eigen::Vector3d(3, 0, 1);
  return T;
}

/// What turns with the sensor: by a tilt about its axes the whole view turns likewise, by a scale it comes
/// nearer along the line of sight (x). The part that the map has from the views before is as of a quarter
/// turn back.
Eigen::Matrix<double, 6, alignment::sensor_error_size> by_error_at(int i) {
  const auto alone = [](int k) {
    Eigen::Matrix<double, 6, alignment::sensor_error_size> by = decltype(by)::Zero();
    const Eigen::Matrix3d R = pose_at(k).linear();
    by.topLeftCorner<3, 3>() = -R;
    by.block<3, 1>(3, 3) = -lever_m * R.col(0);
    return by;
  };
  return alone(i) - alone(i - 18);
}

/// What scan i measures, laid on the map at `laid`, if the map has it at `truth`.
Revisit revisit(int i, const Eigen::Isometry3d& laid, const Eigen::Isometry3d& truth,
                const SensorErrors& errors, std::mt19937_64& rng, int count = 6) {
  std::normal_distribution<double> noise(0, noise_m);
  Revisit r;
  r.lever_m = lever_m;
  r.patches = 100;
  r.scatter_m = alignment::map_error_voxels * resolution;
  Twist per_metre;
  per_metre << Eigen::Vector3d::Constant(lever_m), Eigen::Vector3d::Ones();
  // Translations first, so that fewer directions are those.
  TwistCovariance order = TwistCovariance::Zero();
  for (int k = 0; k < 6; ++k) order(k, (k + 3) % 6) = 1;
  r.directions = (order * TwistCovariance(per_metre.asDiagonal())).topRows(count);
  r.by_error = r.directions * by_error_at(i);
  r.motion = r.directions * alignment::twist_between(laid, truth) + r.by_error * errors;
  for (int k = 0; k < count; ++k) r.motion[k] += noise(rng);
  r.variances.setConstant(count, noise_m * noise_m);
  return r;
}

struct Walk {
  alignment::AlignmentState state;
  std::mt19937_64 rng = test::rng();
  SensorErrors errors = SensorErrors::Zero();
  bool ever_drifted = false;

  /// `truth`: where the map has the scan; `count`: of the directions that are measured, none if 0.
  Eigen::Isometry3d step(int i, const Eigen::Isometry3d& given, const Eigen::Isometry3d& truth,
                         int count = 6) {
    DriftFilter filter(state, SensorKind::depth_camera, resolution, Eigen::Vector3d::UnitZ());
    filter.advance(given);
    const Eigen::Isometry3d laid = filter.pose();
    if (count > 0 && filter.is_new_view()) {
      filter.learn(laid, revisit(i, laid, truth, errors, rng, count));
      state.view_m = state.travelled_m;
    }
    ever_drifted = ever_drifted || filter.drifts();
    return filter.pose();
  }
};

double error_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

/// Slides by 2 mm and turns by 0.03° a scan, about the vertical.
Eigen::Isometry3d slid(int i, const Eigen::Isometry3d& T) {
  return Eigen::Translation3d(0.0015 * i, -0.0013 * i, 0) *
         Eigen::AngleAxisd(0.0005 * i, Eigen::Vector3d::UnitZ()) * T;
}

TEST(DriftFilter, ExactPosesStayBitForBit) {
  Walk walk;
  for (int i = 0; i < 1000; ++i)
    ASSERT_EQ(walk.step(i, pose_at(i), pose_at(i)).matrix(), pose_at(i).matrix()) << i;
}

TEST(DriftFilter, AnErrorOfTheSensorIsNoDriftAndIsFound) {
  Walk walk;
  walk.errors[0] = 0.009;
  walk.errors[1] = -0.006;
  walk.errors[3] = 0.01;
  for (int i = 0; i < 200; ++i)
    ASSERT_EQ(walk.step(i, pose_at(i), pose_at(i)).matrix(), pose_at(i).matrix()) << i;
  const auto& found = walk.state.hypotheses.at(walk.state.believed);
  for (const int k : {0, 1, 3}) {
    const double deviation = std::sqrt(found.covariance(6 + k, 6 + k));
    EXPECT_NEAR(found.errors[k], walk.errors[k], 5 * deviation) << k;
    EXPECT_LT(deviation, 0.2 * std::fabs(walk.errors[k])) << k;
  }
  // Whatever turns about the vertical alone does not tell a tilt about it.
  EXPECT_GT(std::sqrt(found.covariance(8, 8)), 0.015);
}

TEST(DriftFilter, FollowsADriftAlsoBesideAnErrorOfTheSensor) {
  for (const double error : {0.0, 0.009}) {
    Walk walk;
    walk.errors[0] = error;
    walk.errors[3] = -error;
    double given = 0, used = 0;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Isometry3d T = slid(i, pose_at(i)), found = walk.step(i, T, pose_at(i));
      if (i < (error > 0 ? 40 : 20)) continue;
      given += error_m(T, pose_at(i));
      used += error_m(found, pose_at(i));
    }
    EXPECT_LT(used, given / (error > 0 ? 10 : 20));
    EXPECT_NEAR(walk.state.hypotheses.at(walk.state.believed).errors[0], error, 0.2 * 0.009);
  }
}

/// Height, roll and pitch fit every scan, as odometry that knows gravity leaves them; that must not hide that
/// the rest slides (a stair walked up and down, of which only the risers tell it, was mapped twice).
TEST(DriftFilter, ALevelDriftIsNotHiddenByWhatDoesNotDrift) {
  Walk walk;
  for (int i = 0; i < 300; ++i) walk.step(i, pose_at(i), pose_at(i));
  int until = 300;
  for (; until < 400 && !walk.ever_drifted; ++until)
    walk.step(until, slid(until - 300, pose_at(until)), pose_at(until));
  EXPECT_LT(until, 325) << "4 cm";
}

TEST(DriftFilter, WhatTheOctreeWouldNotNoticeStays) {
  Walk walk;
  const Eigen::Translation3d off(0.002, 0.001, 0);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Isometry3d given = off * pose_at(i);
    ASSERT_EQ(walk.step(i, given, pose_at(i)).matrix(), given.matrix()) << i;
  }
}

TEST(DriftFilter, WhereNothingIsSeenAgainTheCorrectionStays) {
  Walk walk;
  for (int i = 0; i < 100; ++i) walk.step(i, slid(i, pose_at(i)), pose_at(i));
  const Eigen::Isometry3d before =
      walk.step(100, slid(100, pose_at(100)), pose_at(100)) * slid(100, pose_at(100)).inverse();
  for (int i = 101; i < 150; ++i) {
    const Eigen::Isometry3d given = slid(i, pose_at(i)), found = walk.step(i, given, pose_at(i), 0);
    EXPECT_LT((found.matrix() - (before * given).matrix()).norm(), 1e-12);
  }
}

TEST(DriftFilter, ADirectionThatNothingMeasuresStaysAsGiven) {
  Walk walk;
  const Eigen::Translation3d off(0.03, 0.03, 0);
  Eigen::Isometry3d found;
  for (int i = 0; i < 100; ++i) found = walk.step(i, i < 20 ? pose_at(i) : off * pose_at(i), pose_at(i), 1);
  EXPECT_TRUE(walk.ever_drifted);
  EXPECT_NEAR(found.translation().x(), pose_at(99).translation().x(), 0.006);
  // Rotations, which nothing measures either, share in what is corrected.
  EXPECT_NEAR(found.translation().y(), 0.03 + pose_at(99).translation().y(), 0.01);
}

TEST(DriftFilter, AJumpThatStaysIsTakenOver) {
  Walk walk;
  for (int i = 0; i < 30; ++i) walk.step(i, pose_at(i), pose_at(i));
  const Eigen::Translation3d off(0.2, -0.1, 0.05);
  DriftFilter filter(walk.state, SensorKind::depth_camera, resolution, Eigen::Vector3d::UnitZ());
  filter.advance(off * pose_at(30));
  filter.jump(off.inverse() * Eigen::Isometry3d::Identity());
  EXPECT_LT(error_m(filter.pose(), pose_at(30)), 1e-9);
  for (int i = 31; i < 60; ++i)
    EXPECT_LT(error_m(walk.step(i, off * pose_at(i), pose_at(i)), pose_at(i)), 0.005) << i;
}

TEST(DriftFilter, OneWildMeasurementMovesLittle) {
  Walk walk;
  for (int i = 0; i < 100; ++i) walk.step(i, slid(i, pose_at(i)), pose_at(i));
  const Eigen::Isometry3d wild = Eigen::Translation3d(0.05, 0.05, 0) * pose_at(100);
  EXPECT_LT(error_m(walk.step(100, slid(100, pose_at(100)), wild), pose_at(100)), 0.015);
}

}  // namespace
}  // namespace octosurf::test
