// What readings mean: whose they are, which are none, in what unit. Written as files and read as a user
// would.
#include "io/readers/scan_files.hpp"

namespace octosurf::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;

using Points = std::vector<Eigen::Vector3f>;

class ReadingRules : public ScanFiles {
 protected:
  /// A PCD in rows of `width`.
  std::filesystem::path write_cloud(const std::string& name, const Points& points, std::size_t width) const {
    const std::size_t rows = points.size() / width;
    std::string text = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                       std::to_string(width) + "\nHEIGHT " + std::to_string(rows) +
                       "\nVIEWPOINT 0 0 1 1 0 0 0\nPOINTS " + std::to_string(points.size()) +
                       "\nDATA binary\n";
    text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof points[0]);
    return write(name, text);
  }
};

/// Rays of 32 rings around z, each of the length that `range(azimuth, elevation)` says, m.
template <class Range>
Points rings(const Range& range) {
  Points points;
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 256; ++column) {
      const double elevation = (row - 15.5) * 2 * std::numbers::pi / 180;
      const double azimuth = column * std::numbers::pi / 128;
      const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      points.push_back((range(row, column) * ray).template cast<float>());
    }
  return points;
}

/// Ranges from 5 to 9 m.
double wavy_walls(int row, int column) { return 7 + 2 * std::sin(0.37 * column + 0.21 * row); }

/// Depths of 64 × 48 pixels.
template <class Depth>
Points pixels(const Depth& depth) {
  Points points;
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u)
      points.push_back(Eigen::Vector3d((u - 31.5) / 50, (v - 23.5) / 50, 1).cast<float>() *
                       static_cast<float>(depth(u, v)));
  return points;
}

TEST_F(ReadingRules, TheRaysTellTheSensorWhateverTheRows) {
  const Points lidar = rings(wavy_walls);
  const Points camera = pixels([](int u, int v) { return 2 + 0.01 * u + 0.02 * v; });
  for (const bool is_lidar : {true, false})
    for (const std::size_t width : {is_lidar ? std::size_t{256} : 64, (is_lidar ? lidar : camera).size()}) {
      const auto source = open_scans({write_cloud("a.pcd", is_lidar ? lidar : camera, width)});
      EXPECT_THAT(source->notes(),
                  ElementsAre(is_lidar ? says("spinning lidar", "", "")
                                       : says("depth camera", "up to 4 m", "--sensor lidar")));
      EXPECT_EQ(source->next()->sensor, is_lidar ? SensorKind::lidar : SensorKind::depth_camera);
    }
}

TEST_F(ReadingRules, AStatedSensorWins) {
  const auto file = write_cloud("lidar.pcd", rings(wavy_walls), 256);
  const auto source = open_scans({file}, {.sensor = SensorKind::depth_camera});
  EXPECT_THAT(source->notes(), ElementsAre(says("a depth camera, as stated")));
  EXPECT_EQ(source->next()->sensor, SensorKind::depth_camera);

  write_png("image.png", 2, 1, {1000, 2000});
  write("intrinsics.txt", unit_camera);
  EXPECT_THROW(read_all({folder / "image.png"}, {.sensor = SensorKind::lidar}), Error);
}

TEST_F(ReadingRules, AFarRangeThatManyRaysHaveIsNoReturn) {
  std::mt19937 random(1);  // fixed: noise that no limit is near
  for (const double none : {120.0, 65.535, 16.0}) {
    std::size_t returns = 0;
    const Points points = rings([&](int row, int column) {
      const bool lost = random() % 4 == 0;
      returns += lost ? 0 : 1;
      return lost ? none : wavy_walls(row, column);
    });
    const auto source = open_scans({write_cloud("a.pcd", points, 256)});
    EXPECT_THAT(source->notes(), Contains(says("taken as no return"))) << none;
    EXPECT_THAT(source->notes(), Contains(says("spinning lidar"))) << none;
    const Scan scan = *source->next();
    EXPECT_EQ(readings(scan), returns) << none;
    EXPECT_EQ(scan.points.size(), points.size());
    EXPECT_EQ(readings(read_all({folder / "a.pcd"}, {.no_return = {0}})[0]), points.size());
  }
}

TEST_F(ReadingRules, ARingOnALevelFloorIsReadings) {
  // 1 m below, without noise: each ring has one range, and the farthest has none near it.
  const Points points = rings([](int row, int) {
    return row < 16 ? 1 / std::sin((15.5 - row) * 2 * std::numbers::pi / 180)
                    : std::numeric_limits<double>::quiet_NaN();
  });
  const auto scans = read_all({write_cloud("a.pcd", points, 256)});
  EXPECT_EQ(readings(scans[0]), 16U * 256U);
}

TEST_F(ReadingRules, AFormatsLargestNumberIsNoReturn) {
  for (const float largest : {std::numeric_limits<float>::max(), 1e10F, 4294967296.F}) {
    Points points = rings(wavy_walls);
    points[100].setConstant(largest);
    points[200] = {0, 0, largest};
    const auto source = open_scans({write_cloud("a.pcd", points, 256)});
    EXPECT_EQ(readings(*source->next()), points.size() - 2);
    EXPECT_THAT(source->notes(), Contains(says("2 readings of its 8192 are farther")));
  }
}

TEST_F(ReadingRules, ACamerasFarDepthThatManyPixelsHaveIsNoReturn) {
  const auto slope = [](int u, int v) { return 2 + 0.01 * u + 0.02 * v; };
  for (const double none : {65.535, 20.0, 10.0}) {
    const Points points = pixels([&](int u, int v) { return (u + v) % 5 == 0 ? none : slope(u, v); });
    const auto source = open_scans({write_cloud("a.pcd", points, 64)});
    EXPECT_THAT(source->notes(), Contains(says("taken as no return"))) << none;
    const Scan scan = *source->next();
    for (const Eigen::Vector3f& p : scan.points) EXPECT_TRUE(!p.allFinite() || p.z() < 5) << p.transpose();
  }
  std::vector<std::uint16_t> image;
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u)
      image.push_back((u / 8 + v / 8) % 3 == 0 ? 10000 : static_cast<std::uint16_t>(1000 * slope(u, v)));
  write_png("image.png", 64, 48, image);
  write("intrinsics.txt", "50 50 31.5 23.5\n");
  const auto source = open_scans({folder / "image.png"});
  EXPECT_THAT(source->notes(), Contains(says("at 10.000 m")));
  EXPECT_EQ(readings(*source->next()),
            static_cast<std::size_t>(std::ranges::count_if(image, [](int d) { return d != 10000; })));
}

TEST_F(ReadingRules, AWallSeenHeadOnIsReadings) {
  // Level to the millimetre, at 3 m and at 6 m, where its floor comes up to it.
  for (const double wall : {3.0, 6.0}) {
    const Points points =
        pixels([&](int, int v) { return v > 23 ? std::min(wall, 1 / ((v - 23.5) / 50)) : wall; });
    const auto source = open_scans({write_cloud("a.pcd", points, 64)});
    EXPECT_THAT(source->notes(), Not(Contains(says("no return")))) << wall;
    EXPECT_EQ(readings(*source->next()), points.size());
  }
}

TEST_F(ReadingRules, NamedValuesAreNoReturnsToTheMillimetre) {
  const Points points =
      rings([](int row, int column) { return column % 8 == 0 ? 3.5 : wavy_walls(row, column); });
  const auto scans = read_all({write_cloud("a.pcd", points, 256)}, {.no_return = {3.5, 77}});
  EXPECT_EQ(readings(scans[0]), points.size() / 8 * 7);
  EXPECT_THROW(read_all({folder / "a.pcd"}, {.no_return = {-1}}), Error);
}

TEST_F(ReadingRules, RaysWithoutAReturnFreeSpaceOnWish) {
  // Of a lidar: a quarter of the turn is at a placeholder; the rays at its rims may graze something.
  const auto open = [](int column) { return column >= 64 && column < 128; };
  const Points points =
      rings([&](int row, int column) { return open(column) ? 120.0 : wavy_walls(row, column); });
  Scan scan = read_all({write_cloud("a.pcd", points, 256)}, {.clear_no_return_m = 6})[0];
  EXPECT_EQ(readings(scan), 32U * 192U);
  ASSERT_EQ(scan.free_rays.size(), 32U * 62U);
  for (const Eigen::Vector3f& ray : scan.free_rays) EXPECT_NEAR(ray.norm(), 6, 1e-4);
  EXPECT_LT((scan.free_rays[0].normalized() - points[65].normalized()).norm(), 1e-5);
  EXPECT_TRUE(read_all({folder / "a.pcd"})[0].free_rays.empty());

  // Of a depth image: pixels without a reading, four at least from the next one.
  std::vector<std::uint16_t> image(64 * 48, 2000);
  std::size_t far_from_readings = 0;
  for (int v = 10; v < 40; ++v)
    for (int u = 20; u < 64; ++u) {
      image[static_cast<std::size_t>(64 * v + u)] = v % 2 == 0 ? 0 : 65535;
      far_from_readings += u >= 24 && v >= 14 && v < 36 ? 1 : 0;
    }
  write_png("image.png", 64, 48, image);
  write("intrinsics.txt", "50 50 31.5 23.5\n");
  scan = read_all({folder / "image.png"}, {.clear_no_return_m = 3})[0];
  EXPECT_EQ(scan.points.size(), 64U * 48U - 30U * 44U);
  EXPECT_EQ(readings(scan), scan.points.size());
  ASSERT_EQ(scan.free_rays.size(), far_from_readings);
  const Eigen::Vector3f first((24 - 31.5F) / 50, (14 - 23.5F) / 50, 1);
  EXPECT_LT((scan.free_rays[0] - 3 * first.normalized()).norm(), 1e-5);
}

TEST_F(ReadingRules, ReadingsInASelfBoxAreTheRobotsOwn) {
  const Points points =
      rings([&](int row, int column) { return column < 16 ? 0.5 : wavy_walls(row, column); });
  ScanSourceOptions options;
  options.self_boxes = {{Eigen::AlignedBox3d(Eigen::Vector3d(0.2, -1, -1), Eigen::Vector3d(1, 1, 1)), {}}};
  const auto source = open_scans({write_cloud("a.pcd", points, 256)}, options);
  EXPECT_EQ(readings(*source->next()), 32U * 240U);
  EXPECT_THAT(source->notes(), Contains(says("self-box: 512 of the 8192 readings")));
  options.self_boxes[0].frame = "base";
  EXPECT_THROW(read_all({folder / "a.pcd"}, options), Error);
}

TEST_F(ReadingRules, ACloudsScaleIsItsViewpointsToo) {
  Points points = rings(wavy_walls);
  for (Eigen::Vector3f& p : points) p *= 1000;
  const auto scans = read_all({write_cloud("a.pcd", points, 256)}, {.cloud_scale = 1000});
  EXPECT_LT((scans[0].points[300] - points[300] / 1000).norm(), 1e-5);
  EXPECT_DOUBLE_EQ(scans[0].T_map_sensor.translation().z(), 0.001);
  EXPECT_THROW(read_all({folder / "a.pcd"}, {.cloud_scale = 0}), Error);
}

}  // namespace
}  // namespace octosurf::test
