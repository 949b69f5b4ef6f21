// Readings of a sensor that moves, against the same places seen at once.
#include "support/testing.hpp"

#include <octosurf/deskew.hpp>

namespace octosurf::test {
namespace {

constexpr double stamp_s = 1700000000.25;

/// A walk on a curve with a turn of 2 rad/s and a swaying height.
Eigen::Isometry3d walk(double t_s) {
  const double t = t_s - stamp_s;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(1.5 * t, 0.4 * t * t, 0.05 * std::sin(9 * t));
  T.linear() = (Eigen::AngleAxisd(0.3 + 2 * t, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(0.1 * std::sin(7 * t), Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return T;
}

struct Sweep {
  Scan scan;                            // as the moving sensor saw them
  std::vector<Eigen::Vector3d> places;  // in the map
};

Sweep sweep(std::size_t readings, double begin_s, double end_s) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  Sweep sweep;
  sweep.scan.stamp_s = stamp_s;
  sweep.scan.T_map_sensor = walk(stamp_s);
  for (std::size_t i = 0; i < readings; ++i) {
    const double t = begin_s + (end_s - begin_s) * static_cast<double>(i) / static_cast<double>(readings);
    sweep.places.push_back(30 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)));
    sweep.scan.points.push_back((walk(stamp_s + t).inverse() * sweep.places.back()).cast<float>());
    sweep.scan.times_s.push_back(static_cast<float>(t));
  }
  return sweep;
}

void expect_undone(const Sweep& sweep, const Scan& undone, double tolerance_m) {
  ASSERT_EQ(undone.points.size(), sweep.places.size());
  ASSERT_EQ(undone.origins.size(), sweep.places.size());
  EXPECT_TRUE(undone.times_s.empty());
  EXPECT_EQ(undone.T_map_sensor.matrix(), sweep.scan.T_map_sensor.matrix());
  for (std::size_t i = 0; i < sweep.places.size(); ++i) {
    const double t = static_cast<double>(sweep.scan.times_s[i]);
    EXPECT_LT((undone.T_map_sensor * undone.points[i].cast<double>() - sweep.places[i]).norm(), tolerance_m);
    EXPECT_LT(
        (undone.T_map_sensor * undone.origins[i].cast<double>() - walk(stamp_s + t).translation()).norm(),
        tolerance_m);
  }
}

TEST(Deskew, ReadingsAreWhereTheyWereSeen) {
  // Stamps at the sweep's begin, end and middle, and of one time only. At 2 rad/s, 30 m and a step of 1 ms
  // floats round most.
  for (const auto& [begin_s, end_s] : {std::pair{0.0, 0.1}, {-0.1, 0.0}, {-0.05, 0.05}, {0.02, 0.02}}) {
    const Sweep moving = sweep(2000, begin_s, end_s);
    expect_undone(moving, deskew(moving.scan, walk), 2e-4);
  }
}

TEST(Deskew, ByPosesAsOftenAsScans) {
  // An arc between poses 0.01 s apart is off by a T²/8: 6e-5 rad for the sway's 4.9 rad/s², 3.2 mm at the
  // farthest place, 52 m away.
  std::vector<StampedPose> poses;
  for (int i = -1; i <= 12; ++i) poses.push_back({stamp_s + 0.01 * i, walk(stamp_s + 0.01 * i)});
  const Sweep moving = sweep(2000, 0, 0.1);
  expect_undone(moving, deskew(moving.scan, poses), 5e-3);
}

TEST(Deskew, BeyondTheLastPoseTheMotionGoesOnForAsLongAsBetween) {
  const auto steady = [](double t) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().x() = 2 * (t - stamp_s);
    T.linear() = Eigen::AngleAxisd(t - stamp_s, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
  };
  Scan scan;
  scan.stamp_s = stamp_s;
  scan.points = {{1, 2, 3}, {4, 5, 6}};
  scan.times_s = {0, 0.1F};
  const std::vector<StampedPose> poses{{stamp_s - 0.1, steady(stamp_s - 0.1)}, {stamp_s, steady(stamp_s)}};
  const Scan undone = deskew(scan, poses);
  EXPECT_LT((undone.points[1].cast<double>() - steady(stamp_s + 0.1) * Eigen::Vector3d(4, 5, 6)).norm(),
            1e-5);
  scan.times_s.back() = 0.12F;
  EXPECT_THROW(deskew(scan, poses), Error);
  scan.times_s = {-0.22F, 0};
  EXPECT_THROW(deskew(scan, poses), Error);
}

TEST(Deskew, WithoutTimesNothingChanges) {
  Scan scan = sweep(10, 0, 0.1).scan;
  scan.times_s.clear();
  const Scan same = deskew(scan, [](double) -> Eigen::Isometry3d { throw std::logic_error("asked"); });
  EXPECT_EQ(same.points, scan.points);
  EXPECT_TRUE(same.origins.empty());
}

TEST(Deskew, AReadingWithoutATimeIsNone) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  Scan scan = sweep(10, 0, 0.1).scan;
  scan.times_s[3] = nan;
  scan.points[5].y() = nan;
  scan.times_s[5] = 1e9F;  // whatever it is
  const Scan undone = deskew(scan, walk);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(undone.points[i].allFinite(), i != 3 && i != 5);
}

TEST(Deskew, RefusesWhatIsNoMotion) {
  const Scan scan = sweep(10, 0, 0.1).scan;
  Scan few = scan, hours = scan;
  few.times_s.pop_back();
  EXPECT_THROW(deskew(few, walk), Error);
  hours.times_s.back() = 4000;
  EXPECT_THROW(deskew(hours, walk), Error);
  const StampedPose now{stamp_s, walk(stamp_s)};
  EXPECT_THROW(deskew(scan, std::vector{now}), Error);
  EXPECT_THROW(deskew(scan, std::vector{now, now}), Error);
  StampedPose bent{stamp_s + 0.2, walk(stamp_s)};
  bent.T_map_sensor.linear() *= 2;
  EXPECT_THROW(deskew(scan, std::vector{now, bent}), Error);
}

}  // namespace
}  // namespace octosurf::test
