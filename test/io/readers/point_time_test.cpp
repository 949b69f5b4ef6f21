// Points' times in every unit and from every zero, in bags and cloud files as drivers and tools write them,
// and what poses undo by them.
#include "io/readers/bag_files.hpp"
#include "io/readers/scan_motion.hpp"

namespace octosurf::test {
namespace {

using ::testing::Contains;

using Zero = io::PointClock::Zero;

constexpr double first_stamp_s = 1700000000.5;

/// Three clouds at 10 Hz; times from `first_s` to `last_s` after the stamp, as `value(stamp, after)` has
/// them.
template <class Value>
std::vector<io::TimedCloud> timed_clouds(double first_s, double last_s, const Value& value) {
  std::vector<io::TimedCloud> all;
  for (int i = 0; i < 3; ++i) {
    const double stamp = first_stamp_s + 0.1 * i;
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
                 [&](double stamp, double s) { return (stamp - first_stamp_s + 777 + s) / unit_s; });
  }
}

TEST(PointClock, AnyPeriodOfScans) {
  for (const double period_s : {0.02, 0.05, 1.0, 5.0, 100.0})  // from 50 Hz to every thousandth scan recorded
    for (const double unit_s : {1.0, 1e-9}) {
      const double span_s = std::min(period_s, 0.1);
      const auto clock =
          io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 0, span_s / unit_s}}, period_s);
      ASSERT_TRUE(clock);
      EXPECT_EQ(clock->unit_s, unit_s) << period_s;
    }
}

TEST(PointClock, WhatIsAllAtOnceOrFitsNoUnitIsNoTime) {
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 0, 0}}, 0.1));
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 5, 5}}, 0.1));
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 0, 1e12}}, 0.1));
  EXPECT_FALSE(io::clock_of({}, 0.1));
}

TEST(PointClock, OnlyReadingsCount) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector3f> points{{1, 0, 0}, {nan, nan, nan}, {2, 0, 0}, {3, 0, 0}};
  const io::PointTimes times{"timestamp", {first_stamp_s + 0.01, 0, first_stamp_s + 0.09, std::nan("")}};
  const auto cloud = io::timed_cloud(first_stamp_s, points, times);
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->first, first_stamp_s + 0.01);
  EXPECT_EQ(cloud->last, first_stamp_s + 0.09);
  const auto clock = io::clock_of(std::vector{*cloud}, 0.1);
  ASSERT_TRUE(clock);
  const auto after = clock->after_stamp(first_stamp_s, points, times);
  EXPECT_NEAR(after[0], 0.01, 1e-6);
  EXPECT_TRUE(std::isnan(after[1]));
  EXPECT_NEAR(after[2], 0.09, 1e-6);
  EXPECT_TRUE(std::isnan(after[3]));
}

// A sensor at 2 m/s that sees a wall at x = 10.

constexpr int points_each = 11, scan_count = 4;

double stamp_of(int scan) { return first_stamp_s + 0.1 * scan; }
double after_stamp(int point) { return 0.0099 * point; }
double place_at(double time_s) { return 2 * (time_s - first_stamp_s); }

/// A field of a cloud with times.
struct DriverField {
  std::string name;
  std::uint8_t datatype;    // PointField's
  const char *size, *type;  // as PCD has them
  double unit_s;
  bool absolute;

  std::string bytes(double stamp_s, double after_s) const {
    const double value = ((absolute ? stamp_s : 0) + after_s) / unit_s;
    switch (datatype) {
      case 5:
        return bytes_of(static_cast<std::int32_t>(std::round(value)));
      case 6:
        return bytes_of(static_cast<std::uint32_t>(std::round(value)));
      case 7:
        return bytes_of(static_cast<float>(value));
      default:
        return bytes_of(value);
    }
  }
};
const std::vector<DriverField> time_fields{
    {"t", 6, "4", "U", 1e-9, false},           {"time", 7, "4", "F", 1, false},
    {"timestamp", 8, "8", "F", 1, true},       {"timestamp", 8, "8", "F", 1e-9, true},
    {"offset_time", 6, "4", "U", 1e-9, false}, {"time_stamp", 6, "4", "U", 1e-6, false},
    {"time", 7, "4", "F", 1e-6, false},        {"t", 5, "4", "I", 1e-6, false}};

class PointTime : public ScanFiles {
 protected:
  /// With tf at 100 Hz.
  std::filesystem::path bag(const DriverField& time, double moves = 1, std::uint32_t rows = 1) const {
    std::vector<McapMessage> messages;
    for (int i = -2; i < 10 * scan_count + 3; ++i) {
      const double t = first_stamp_s + 0.01 * i;
      messages.push_back(tf(t, "map", "lidar", moves * place_at(t)));
    }
    for (const McapMessage& cloud : clouds(time, rows)) messages.push_back(cloud);
    return write("a.mcap", mcap_of(messages));
  }
  static std::vector<McapMessage> clouds(const DriverField& time, std::uint32_t height = 1) {
    std::vector<McapMessage> all;
    for (int scan = 0; scan < scan_count; ++scan) {
      CdrBytes cloud;
      cloud.header(stamp_of(scan), "lidar").u32(height).u32(points_each / height).u32(4);
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        cloud.text(std::string("xyz").substr(axis, 1)).u32(4 * axis).u8(7).u32(1);
      const std::string rows = rows_of(time, scan);
      const auto step = static_cast<std::uint32_t>(rows.size() / points_each);
      cloud.text(time.name).u32(12).u8(time.datatype).u32(1);
      cloud.u8(0).u32(step).u32(points_each / height * step).bytes(rows).u8(1);
      all.push_back({"/points", "sensor_msgs/msg/PointCloud2", stamp_of(scan), cloud.all()});
    }
    return all;
  }

  /// x y z and the time.
  static std::string rows_of(const DriverField& time, int scan) {
    std::string rows;
    for (int i = 0; i < points_each; ++i) {
      const double stamp = stamp_of(scan);
      rows +=
          bytes_of(static_cast<float>(10 - place_at(stamp + after_stamp(i))), static_cast<float>(i), 0.5F);
      rows += time.bytes(stamp, after_stamp(i));
    }
    return rows;
  }

  static std::string name_of(int scan) { return std::to_string(stamp_of(scan)); }
  void write_timed_pcd(const std::string& name, const DriverField& time, int scan) const {
    write(name, "VERSION 0.7\nFIELDS x y z " + time.name + "\nSIZE 4 4 4 " + time.size + "\nTYPE F F F " +
                    time.type + "\nCOUNT 1 1 1 1\nWIDTH 11\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 11\n" +
                    "DATA binary\n" + rows_of(time, scan));
  }

  ScanSourceOptions with_poses() const {
    std::string lines;
    for (int i = -2; i < 10 * scan_count + 3; ++i) {
      const double t = first_stamp_s + 0.01 * i;
      lines += std::to_string(t) + " " + std::to_string(place_at(t)) + " 0 0 0 0 0 1\n";
    }
    return test::with_poses(write("trajectory.txt", lines));
  }

  /// All points on the wall, and rays from where the sensor was.
  static void expect_undone(const std::vector<Scan>& read) {
    ASSERT_GE(read.size() + 1, static_cast<std::size_t>(scan_count));
    for (const Scan& s : read) {
      ASSERT_EQ(s.origins.size(), static_cast<std::size_t>(points_each));
      EXPECT_TRUE(s.times_s.empty());
      for (int i = 0; i < points_each; ++i) {
        const auto at = static_cast<std::size_t>(i);
        EXPECT_NEAR(s.T_map_sensor.translation().x() + static_cast<double>(s.points[at].x()), 10, 1e-4);
        EXPECT_NEAR(static_cast<double>(s.origins[at].x()), 2 * after_stamp(i), 1e-4);
      }
    }
  }
};

TEST_F(PointTime, OfBagsUndoesTheMotion) {
  for (const DriverField& time : time_fields) {
    SCOPED_TRACE(time.name + " " + std::to_string(time.unit_s));
    const char* const unit = time.unit_s == 1 ? "s" : time.unit_s == 1e-6 ? "µs" : "ns";
    const auto source = open_scans({bag(time)});
    EXPECT_THAT(source->notes(),
                Contains(says("field " + time.name + " (" + unit +
                                  (time.absolute ? " on the stamps' clock" : " after the stamp"),
                              "undone", "up to 20 cm")));
    expect_undone(read_all(*source));
  }
}

TEST_F(PointTime, WithTooFewPosesIsToldAndTheMotionLeft) {
  std::vector<McapMessage> messages = clouds(time_fields.front());
  messages.push_back(tf(stamp_of(1), "map", "lidar", place_at(stamp_of(1))));
  const auto source = open_scans({write("a.mcap", mcap_of(messages))}, {.skip_bad = true});
  EXPECT_THAT(source->notes(), Contains(says("not undone in 1 of 1", "as often as scans")));
  const auto read = read_all(*source);
  ASSERT_EQ(read.size(), 1U);
  EXPECT_NEAR(static_cast<double>(read[0].points.back().x()), 10 - place_at(stamp_of(1) + after_stamp(10)),
              1e-5);
  ASSERT_EQ(read[0].times_s.size(), static_cast<std::size_t>(points_each)) << "for who knows the poses";
  EXPECT_NEAR(static_cast<double>(read[0].times_s.back()), after_stamp(points_each - 1), 1e-6);
}

TEST_F(PointTime, OfPcdsUndoesTheMotion) {
  for (const DriverField& time : time_fields) {
    SCOPED_TRACE(time.name + " " + std::to_string(time.unit_s));
    const std::string folder_name = "pcd_" + time.name + std::to_string(std::lround(1e9 * time.unit_s));
    for (int scan = 0; scan < scan_count; ++scan)
      write_timed_pcd(folder_name + "/" + name_of(scan) + ".pcd", time, scan);
    expect_undone(read_all({folder / folder_name}, with_poses()));
  }
}

TEST_F(PointTime, OfPlysUndoesTheMotion) {
  for (int scan = 0; scan < scan_count; ++scan) {
    std::string rows;
    for (int i = 0; i < points_each; ++i)
      rows += std::to_string(std::lround(1e6 * after_stamp(i))) + " " +
              std::to_string(10 - place_at(stamp_of(scan) + after_stamp(i))) + " " + std::to_string(i) +
              " 0.5\n";
    write("ply/" + name_of(scan) + ".ply",
          "ply\nformat ascii 1.0\nelement vertex 11\nproperty uint t\nproperty float x\nproperty float y\n"
          "property float z\nend_header\n" +
              rows);
    write("binary/" + name_of(scan) + ".ply",
          "ply\nformat binary_little_endian 1.0\nelement vertex 11\nproperty float x\nproperty float y\n"
          "property float z\nproperty double timestamp\nend_header\n" +
              rows_of(time_fields[2], scan));
  }
  expect_undone(read_all({folder / "ply"}, with_poses()));
  expect_undone(read_all({folder / "binary"}, with_poses()));
}

TEST_F(PointTime, WithAPoseForEachScanIsEnough) {
  std::string poses, times;
  for (int scan = 0; scan < scan_count; ++scan) {
    write_timed_pcd("clouds/" + std::to_string(scan) + ".pcd", time_fields.front(), scan);
    poses += std::to_string(place_at(stamp_of(scan))) + " 0 0 0 0 0 1\n";
    times += std::to_string(stamp_of(scan)) + "\n";
  }
  write("clouds/poses.txt", poses);
  EXPECT_TRUE(read_all({folder / "clouds"}).at(0).origins.empty()) << "without time stamps";
  write("clouds/times.txt", times);
  auto read = read_all({folder / "clouds"});
  ASSERT_EQ(read.back().times_s.size(), static_cast<std::size_t>(points_each)) << "no pose after it";
  read.pop_back();
  expect_undone(read);
}

}  // namespace
}  // namespace octosurf::test
