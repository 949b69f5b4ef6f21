// The steps from a listed scan to one in the map's frame, each by itself.
#include "io/readers/recorded_scan.hpp"

#include "io/readers/scan_files.hpp"

#include <gmock/gmock.h>
#include <numbers>

namespace octosurf::test {
namespace {

TEST(RecordedScans, HaveStampsThatDoNotDecrease) {
  io::StampSequence stamps;
  EXPECT_EQ(stamps.next({}, 10), 0);
  EXPECT_DOUBLE_EQ(stamps.next({}, 10), 0.1);
  stamps.begin_recording();
  EXPECT_DOUBLE_EQ(stamps.next(5.0, 10), 5.0);
  EXPECT_DOUBLE_EQ(stamps.next(5.5, 10), 5.5);
  stamps.begin_recording();
  EXPECT_DOUBLE_EQ(stamps.next(1.0, 10), 5.6);
  EXPECT_DOUBLE_EQ(stamps.next(1.5, 10), 6.1);
}

TEST(RecordedScans, OfASurveyComeNearTheOrigin) {
  io::RawScan raw;
  raw.scan.points = {{1, 0, 0}};
  raw.shift = {1000, 0, 0};
  const Eigen::Vector3d origin(990, 0, 0);
  EXPECT_EQ(io::place(raw, origin).points[0], Eigen::Vector3f(11, 0, 0)) << "without a pose";
  raw.scan.T_map_sensor =
      Eigen::Translation3d(995, 0, 0) * Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  const Scan placed = io::place(raw, origin);
  EXPECT_TRUE(placed.points[0].isApprox(Eigen::Vector3f(0, -6, 0), 1e-6F)) << "seen from the sensor";
  EXPECT_EQ(placed.T_map_sensor.translation(), Eigen::Vector3d(5, 0, 0));
  raw.scan.T_map_sensor.translation().x() = 1e6;
  EXPECT_THAT(failure(Error::Kind::data, [&] { io::place(raw, origin); }),
              testing::HasSubstr("its points lie about 1000 0 0 m, its pose at 1000000 0 0"));
}

TEST(RecordedScans, AreOfOneSizeInARecording) {
  std::optional<std::pair<int, int>> before;
  io::RawScan image;
  for (const int width : {640, 0, 640}) {  // 0: no image
    image.width = width;
    image.height = 480;
    io::require_size_as_before(image, before);
  }
  image.width = 320;
  EXPECT_THAT(failure(Error::Kind::data, [&] { io::require_size_as_before(image, before); }),
              testing::HasSubstr("320x480 pixels, but the images before have 640x480"));
}

}  // namespace
}  // namespace octosurf::test
