// Times of points in every unit and from every zero, and what poses undo by them.
#include "io/readers/scan_motion.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <limits>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Zero = io::PointClock::Zero;

constexpr double start_s = 1700000000.125;

/// Three clouds at 10 Hz; times from `first_s` to `last_s` after the stamp, as `value(stamp, after)` has
/// them.
template <class Value>
std::vector<io::TimedCloud> timed_clouds(double first_s, double last_s, const Value& value) {
  std::vector<io::TimedCloud> all;
  for (int i = 0; i < 3; ++i) {
    const double stamp = start_s + 0.1 * i;
    all.push_back({stamp, value(stamp, first_s), value(stamp, last_s)});
  }
  return all;
}

TEST(PointClock, UnitsAreToldBySpan) {
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    const auto expect_clock = [&](Zero zero, double first_s, const auto& value) {
      const auto clock = io::clock_of(timed_clouds(first_s, first_s + 0.0999, value), 0.1);
      ASSERT_TRUE(clock) << unit_s;
      EXPECT_EQ(clock->unit_s, unit_s);
      EXPECT_EQ(clock->zero, zero);
    };
    for (const double first_s : {0.0, -0.0999, -0.05}) {
      expect_clock(Zero::stamp, first_s, [&](double, double s) { return s / unit_s; });
      expect_clock(Zero::epoch, first_s, [&](double stamp, double s) { return (stamp + s) / unit_s; });
    }
    // Seconds since the sensor was switched on.
    expect_clock(Zero::other_clock, 0,
                 [&](double stamp, double s) { return (stamp - start_s + 777 + s) / unit_s; });
  }
}

TEST(PointClock, AnyPeriodOfScans) {
  for (const double period_s : {0.02, 0.05, 1.0, 5.0, 100.0})  // from 50 Hz to every thousandth scan recorded
    for (const double unit_s : {1.0, 1e-9}) {
      const double span_s = std::min(period_s, 0.1);
      const auto clock = io::clock_of(std::vector<io::TimedCloud>{{start_s, 0, span_s / unit_s}}, period_s);
      ASSERT_TRUE(clock);
      EXPECT_EQ(clock->unit_s, unit_s) << period_s;
    }
}

TEST(PointClock, WhatIsAllAtOnceOrFitsNoUnitIsNoTime) {
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{start_s, 0, 0}}, 0.1));
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{start_s, 5, 5}}, 0.1));
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{start_s, 0, 1e12}}, 0.1));
  EXPECT_FALSE(io::clock_of({}, 0.1));
}

TEST(PointClock, OnlyReadingsCount) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector3f> points{{1, 0, 0}, {nan, nan, nan}, {2, 0, 0}, {3, 0, 0}};
  const io::PointTimes times{"timestamp", {start_s + 0.01, 0, start_s + 0.09, std::nan("")}};
  const auto cloud = io::timed_cloud(start_s, points, times);
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->first, start_s + 0.01);
  EXPECT_EQ(cloud->last, start_s + 0.09);
  const auto clock = io::clock_of(std::vector{*cloud}, 0.1);
  ASSERT_TRUE(clock);
  const auto after = clock->after_stamp(start_s, points, times);
  EXPECT_NEAR(after[0], 0.01, 1e-6);
  EXPECT_TRUE(std::isnan(after[1]));
  EXPECT_NEAR(after[2], 0.09, 1e-6);
  EXPECT_TRUE(std::isnan(after[3]));
}

/// A sensor that goes 2 m/s along x and sees one place after the other, 10 m ahead, for 0.1 s.
class Walk {
 public:
  explicit Walk(const std::string& field, double unit_s = 1e-9) : field_(field), unit_s_(unit_s) {}

  io::ScanMotion::Recording recording() const {
    io::ScanMotion::Recording recording;
    for (int i = 0; i < 6; ++i) recording.stamps_s.push_back(start_s + 0.1 * i);
    recording.pose_at = pose_at;
    recording.read = [this](std::size_t) { return scan(); };
    recording.real = true;
    return recording;
  }
  io::RawScan scan() const {
    io::RawScan raw;
    raw.scan.stamp_s = start_s;
    raw.scan.T_map_sensor = pose_at(start_s);
    raw.scan.sensor = SensorKind::lidar;
    raw.times.field = field_;
    for (int i = 0; i <= 10; ++i) {
      raw.scan.points.emplace_back(10 - 0.02F * static_cast<float>(i), 1.0F, 0.0F);
      if (!field_.empty()) raw.times.values.push_back(0.01 * i / unit_s_);
    }
    return raw;
  }
  static Eigen::Isometry3d pose_at(double t) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().x() = 2 * (t - start_s);
    return T;
  }

 private:
  std::string field_;
  double unit_s_;
};

TEST(ScanMotion, IsUndoneAndTold) {
  const Walk walk("t");
  const io::ScanMotion motion(walk.recording());
  EXPECT_THAT(motion.notes(),
              ElementsAre(AllOf(HasSubstr("field t (ns after the stamp)"), HasSubstr("undone"),
                                HasSubstr("up to 20 cm"), HasSubstr("--deskew off"))));
  const Scan scan = motion(walk.scan());
  EXPECT_TRUE(scan.times_s.empty());
  for (std::size_t i = 0; i <= 10; ++i) {
    EXPECT_NEAR(scan.points[i].x(), 10, 1e-5);
    EXPECT_NEAR(scan.origins[i].x(), 0.02 * static_cast<double>(i), 1e-5);
  }
}

TEST(ScanMotion, IsLeftIfSoWished) {
  const Walk walk("t");
  auto recording = walk.recording();
  recording.undo = false;
  const io::ScanMotion motion(recording);
  EXPECT_THAT(motion.notes(), ElementsAre(HasSubstr("not undone")));
  const Scan scan = motion(walk.scan());
  EXPECT_EQ(scan.points, walk.scan().scan.points);
  EXPECT_TRUE(scan.origins.empty());
  EXPECT_NEAR(scan.times_s.back(), 0.1, 1e-6);
}

TEST(ScanMotion, PosesAsOftenAsScansAreEnough) {
  const Walk walk("time", 1);
  auto recording = walk.recording();
  recording.pose_at = [](double t) {
    const double nearest = start_s + 0.1 * std::round((t - start_s) * 10);
    if (std::abs(t - nearest) > 1e-6) throw std::runtime_error("no pose");
    return Walk::pose_at(t);
  };
  const io::ScanMotion motion(recording);
  EXPECT_THAT(motion.notes(), ElementsAre(HasSubstr("up to 20 cm")));
  io::RawScan last = walk.scan();  // its poses lie before it
  last.scan.stamp_s += 0.5;
  last.scan.T_map_sensor = Walk::pose_at(last.scan.stamp_s);
  const Scan scan = motion(last);
  ASSERT_FALSE(scan.origins.empty());
  EXPECT_NEAR(scan.points[10].x(), 10, 1e-4);
}

TEST(ScanMotion, WithTooFewPosesIsToldAndLeft) {
  const Walk walk("t");
  auto recording = walk.recording();
  recording.stamps_s = {start_s, start_s + 0.1, start_s + 0.2};
  recording.pose_at = [](double t) {
    if (t != start_s + 0.1) throw std::runtime_error("no pose");
    return Walk::pose_at(t);
  };
  const io::ScanMotion motion(recording);
  EXPECT_THAT(motion.notes(),
              ElementsAre(AllOf(HasSubstr("not undone in 1 of 1"), HasSubstr("--max-pose-gap"))));
  EXPECT_EQ(motion(walk.scan()).points, walk.scan().scan.points);
}

TEST(ScanMotion, OfALidarWithoutTimesIsToldInCentimetres) {
  const Walk walk("");
  EXPECT_THAT(io::ScanMotion(walk.recording()).notes(),
              ElementsAre(AllOf(HasSubstr("none for each point"), HasSubstr("within 100 ms"),
                                HasSubstr("20 cm off"), HasSubstr("field t, time or timestamp"))));
  auto camera = walk.recording();
  camera.read = [&](std::size_t) {
    io::RawScan raw = walk.scan();
    raw.scan.sensor = SensorKind::depth_camera;
    return raw;
  };
  EXPECT_TRUE(io::ScanMotion(camera).notes().empty());
  auto still = walk.recording();
  still.pose_at = [](double) { return Eigen::Isometry3d::Identity(); };
  EXPECT_TRUE(io::ScanMotion(still).notes().empty());
}

}  // namespace
}  // namespace octosurf::test
