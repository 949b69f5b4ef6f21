// What readings mean: whose they are, which are none, in what unit. Written as files and read as a user
// would.
#include "io/readers/scan_files.hpp"

namespace octosurf::test {
namespace {

using ::testing::Contains;

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

TEST_F(ReadingRules, ACloudIsALidarsUnlessTheFileOrAnOptionSaysOther) {
  const Points points = pixels([](int u, int v) { return 2 + 0.01 * u + 0.02 * v; });
  const auto sensor = [](const std::filesystem::path& file, const ScanSourceOptions& options = {}) {
    const auto source = open_scans({file}, options);
    const SensorKind kind = source->sensor();
    EXPECT_EQ(source->next()->sensor, kind);
    return kind;
  };
  const auto rows = write_cloud("rows.pcd", points, 64), column = write_cloud("column.pcd", points, 1);
  EXPECT_EQ(sensor(rows), SensorKind::lidar);
  EXPECT_EQ(sensor(rows, {.sensor = SensorKind::depth_camera}), SensorKind::depth_camera);
  EXPECT_EQ(sensor(column), SensorKind::depth_camera) << "as a camera's scans are kept";
  EXPECT_EQ(sensor(column, {.sensor = SensorKind::lidar}), SensorKind::lidar);
  EXPECT_EQ(sensor_of_frame("camera_depth_optical_frame"), SensorKind::depth_camera);
  EXPECT_EQ(sensor_of_frame("optical_frame_of_lidar"), SensorKind::lidar);

  write_png("image.png", 2, 1, {1000, 2000});
  write("intrinsics.txt", unit_camera);
  EXPECT_THROW(open_scans({folder / "image.png"}, {.sensor = SensorKind::lidar}), Error);
}

TEST_F(ReadingRules, AFarValueThatManyReadingsShareIsAReadingUnlessNamed) {
  const Points points =
      rings([](int row, int column) { return column % 4 == 0 ? 120.0 : wavy_walls(row, column); });
  const auto file = write_cloud("a.pcd", points, 256);
  EXPECT_EQ(readings(read_all({file})[0]), points.size());
  EXPECT_EQ(readings(read_all({file}, {.no_return = {120}})[0]), points.size() / 4 * 3);
}

TEST_F(ReadingRules, AFormatsLargestNumberIsNoReturn) {
  for (const float largest : {std::numeric_limits<float>::max(), 1e10F, 4294967296.F}) {
    Points points = rings(wavy_walls);
    points[100].setConstant(largest);
    points[200] = {0, 0, largest};
    EXPECT_EQ(readings(read_all({write_cloud("a.pcd", points, 256)})[0]), points.size() - 2);
  }
}

TEST_F(ReadingRules, ACamerasNamedDepthIsNoReturn) {
  std::vector<std::uint16_t> image;
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u)
      image.push_back((u / 8 + v / 8) % 3 == 0 ? 10000 : static_cast<std::uint16_t>(2000 + 10 * u + 20 * v));
  write_png("image.png", 64, 48, image);
  write("intrinsics.txt", "50 50 31.5 23.5\n");
  EXPECT_EQ(readings(read_all({folder / "image.png"}, {.no_return = {10}})[0]),
            static_cast<std::size_t>(std::ranges::count_if(image, [](int d) { return d != 10000; })));
}

TEST_F(ReadingRules, NamedValuesAreNoReturnsToTheMillimetre) {
  const Points points =
      rings([](int row, int column) { return column % 8 == 0 ? 3.5 : wavy_walls(row, column); });
  const auto scans = read_all({write_cloud("a.pcd", points, 256)}, {.no_return = {3.5, 77}});
  EXPECT_EQ(readings(scans[0]), points.size() / 8 * 7);
  EXPECT_THROW(read_all({folder / "a.pcd"}, {.no_return = {-1}}), Error);
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
  const auto scans = read_all({write_cloud("a.pcd", points, 256)}, {.depth_scale = 1000});
  EXPECT_LT((scans[0].points[300] - points[300] / 1000).norm(), 1e-5);
  EXPECT_DOUBLE_EQ(scans[0].T_map_sensor.translation().z(), 0.001);
  EXPECT_THROW(read_all({folder / "a.pcd"}, {.depth_scale = 0}), Error);
}

}  // namespace
}  // namespace octosurf::test
