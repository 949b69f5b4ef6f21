#include "io/readers/cloud_file.hpp"
#include "io/readers/scan_files.hpp"
#include "io/readers/scan_graph.hpp"

#include <octomap/octomap.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

namespace octosurf::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

class Clouds : public ScanFiles {
 protected:
  static void expect_points(const std::vector<Eigen::Vector3f>& points,
                            const std::vector<Eigen::Vector3f>& expected) {
    ASSERT_EQ(points.size(), expected.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(points[i].allFinite(), expected[i].allFinite()) << i;
      if (expected[i].allFinite()) {
        EXPECT_EQ(points[i], expected[i]) << i;
      }
    }
  }

  /// What `read` refuses the content with; it must name the file and print nothing.
  template <typename Read>
  std::string refusal(const Read& read, const std::string& name, std::string_view content) const {
    const auto file = write(name, content);
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const std::string message = failure(Error::Kind::data, [&] { read(file); });
    EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    EXPECT_THAT(message, says(name));
    return message;
  }

  std::string refused_pcd(std::string_view content) const {
    return refusal(io::read_pcd, "bad.pcd", content);
  }
  std::string refused_ply(std::string_view content) const {
    return refusal(io::read_ply, "bad.ply", content);
  }
  /// What a good file with one text replaced is refused with.
  using Changes = std::vector<std::array<const char*, 3>>;
  void expect_pcd(const std::string& content, const std::vector<Eigen::Vector3f>& expected) const {
    expect_points(io::read_pcd(write("a.pcd", content)).points, expected);
  }
  void expect_ply(const std::string& content, const std::vector<Eigen::Vector3f>& expected) const {
    expect_points(io::read_ply(write("a.ply", content)).points, expected);
  }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// 40 × 30, with a label, like an annotated depth frame.
pcl::PointCloud<pcl::PointXYZL> organised_cloud() {
  pcl::PointCloud<pcl::PointXYZL> cloud(40, 30);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud[i].x = static_cast<float>(i % 40);
    cloud[i].y = static_cast<float>(i / 40) - 10;
    cloud[i].z = i % 7 == 0 ? nan : 2;
    cloud[i].label = static_cast<std::uint32_t>(i);
  }
  cloud.sensor_origin_ = {1, 2, 3, 0};
  cloud.sensor_orientation_ = Eigen::Quaternionf(0, 1, 0, 0);
  return cloud;
}

std::vector<Eigen::Vector3f> points_of(const pcl::PointCloud<pcl::PointXYZL>& cloud) {
  std::vector<Eigen::Vector3f> points;
  for (const auto& point : cloud) points.emplace_back(point.x, point.y, point.z);
  return points;
}

TEST_F(Clouds, PcdOfEveryDataKindGivesPointsAndPoseUnlessTruncated) {
  const auto cloud = organised_cloud();
  pcl::PCDWriter writer;
  const std::string file = (folder / "cloud.pcd").string();
  for (int kind = 0; kind < 3; ++kind) {
    if (kind == 0) writer.writeASCII(file, cloud);
    if (kind == 1) writer.writeBinary(file, cloud);
    if (kind == 2) writer.writeBinaryCompressed(file, cloud);
    const io::Cloud read = io::read_pcd(file);
    expect_points(read.points, points_of(cloud));
    EXPECT_EQ(read.T_map_sensor.translation(), Eigen::Vector3d(1, 2, 3));
    EXPECT_LT((read.T_map_sensor.linear().diagonal() - Eigen::Vector3d(1, -1, -1)).norm(), 1e-6);
    const std::string whole = read_file(file);
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{30}, std::size_t{150}, whole.size() / 2, whole.size() - 40})
      refused_pcd(whole.substr(0, length));
  }
}

TEST_F(Clouds, PcdFieldsMayBeDoubleAndInAnyOrder) {
  const io::Cloud cloud = io::read_pcd(
      write("cloud.pcd",
            "VERSION .7\nFIELDS intensity z fpfh y x\nSIZE 4 8 2 8 8\nTYPE F F U F F\nCOUNT 1 1 3 1 1\n"
            "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary\n" +
                bytes_of(0.5f, 3.0, std::uint16_t{7}, std::uint16_t{8}, std::uint16_t{9}, 2.0, 1.0) +
                bytes_of(0.5f, 6.0, std::uint16_t{7}, std::uint16_t{8}, std::uint16_t{9}, 5.0, 4.0)));
  expect_points(cloud.points, {{1, 2, 3}, {4, 5, 6}});
  EXPECT_TRUE(cloud.T_map_sensor.isApprox(Eigen::Isometry3d::Identity()));
}

TEST_F(Clouds, CoordinatesThatAreNotFiniteAndTheOriginAreNoReading) {
  expect_pcd(replaced(read_file(write_pcd("good.pcd")), "1 2 3\n4 5 6", "0 0 0\n1 inf 2"),
             {{nan, nan, nan}, {nan, nan, nan}, {nan, nan, nan}});
}

TEST_F(Clouds, PcdHeadersAreNotBelieved) {
  const std::string good = read_file(write_pcd("good.pcd"));
  for (const auto& [from, to, message] : Changes{{"POINTS 3", "POINTS 4", "not POINTS"},
                                                 {"POINTS 3", "POINTS -3", "'-3'"},
                                                 {"COUNT 1 1 1", "COUNT 1 1 1000000000", "field 'z'"},
                                                 {"SIZE 4 4 4", "SIZE 4 4 3", "field 'z'"},
                                                 {"SIZE 4 4 4", "SIZE 4 4", "differ in length"},
                                                 {"FIELDS x y z", "FIELDS x y w", "x, y and z"},
                                                 {"FIELDS x y z", "FIELDS x x z", "x, y and z"},
                                                 {"TYPE F F F", "TYPE F F U", "x, y and z"},
                                                 {"POINTS 3\n", "POINTS 3\nCOUNT 9 9 9\n", "'COUNT'"},
                                                 {"DATA ascii", "DATA sealed", "DATA"},
                                                 {"0 0 0 1 0 0 0", "0 0 0 1 0 0", "VIEWPOINT"},
                                                 {"4 5 6", "4 5", "bad.pcd:13: 2 values"},
                                                 {"4 5 6", "4 5 six", "bad.pcd:13: 'six' is not a number"}})
    EXPECT_THAT(refused_pcd(replaced(good, from, to)), says(message));
  const auto sized = [&](const std::string& width, const std::string& points) {
    return replaced(replaced(good, "WIDTH 3", "WIDTH " + width), "POINTS 3", "POINTS " + points);
  };
  EXPECT_THAT(refused_pcd(replaced(sized("0", "0"), "1 2 3\n", "")), says("without points"));
  EXPECT_THAT(refused_pcd(sized("100000000", "100000000")), says("3 of 100000000 points"));
  EXPECT_THAT(refused_pcd(replaced(sized("4000000000", "3"), "HEIGHT 1", "HEIGHT 4000000000")),
              says("not POINTS"));
  EXPECT_THAT(refused_pcd(replaced(good, "DATA ascii", "DATA binary_compressed") + bytes_of(~0u, ~0u)),
              says("truncated or damaged"));
}

TEST_F(Clouds, PlyOfEveryFormatGivesPoints) {
  const std::string properties =
      "element vertex 2\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  expect_ply(
      "ply\nformat ascii 1.0\ncomment by hand\n" + properties + "1 2 3 9 9 9\n4 5 nan 9 9 9\n3 0 1 1\n",
      {{1, 2, 3}, {4, 5, nan}});
  const std::uint8_t c = 9;
  expect_ply("ply\nformat binary_little_endian 1.0\n" + properties +
                 bytes_of(1.f, 2.f, 3.0, c, c, c, 4.f, 5.f, 6.0, c, c, c) +
                 bytes_of(std::uint8_t{3}, 0, 1, 1),
             {{1, 2, 3}, {4, 5, 6}});
}

TEST_F(Clouds, PlyOfPclAndBigEndianAreRead) {
  pcl::PointCloud<pcl::PointXYZL> cloud = organised_cloud();
  const std::string file = (folder / "pcl.ply").string();
  for (const bool binary : {false, true}) {
    pcl::io::savePLYFile(file, cloud, binary);
    const io::Cloud read = io::read_ply(file);
    expect_points(read.points, points_of(cloud));
    EXPECT_EQ(read.T_map_sensor.matrix(), Eigen::Matrix4d::Identity());
  }
  std::string values;
  for (const float value : {1.f, 2.f, 3.f}) {
    std::string bytes = bytes_of(value);
    values.append(bytes.rbegin(), bytes.rend());
  }
  expect_ply(
      "ply\nformat binary_big_endian 1.0\nelement time 2\nproperty double t\nelement vertex 1\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n" +
          bytes_of(0.0, 0.0) + values,
      {{1, 2, 3}});
}

TEST_F(Clouds, BadPlysAreRefused) {
  const std::string good =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "end_header\n1 2 3\n4 5 6\n";
  expect_ply(good, {{1, 2, 3}, {4, 5, 6}});
  EXPECT_THAT(refused_ply(""), says("PLY header"));
  EXPECT_THAT(refused_ply(good.substr(0, 60)), says("PLY header"));
  for (const auto& [from, to, message] : Changes{
           {"vertex 2", "vertex 0", "without points"},
           {"vertex 2", "vertex 3", "bad.ply"},
           {"vertex 2", "vertex 400000000", "2 of 400000000 points"},
           {"vertex 2", "vertex -2", "'-2'"},
           {"4 5 6", "4 5", "bad.ply:9: 2 values"},
           {"float z", "float w", "one each of x, y and z"},
           {"float z", "int z", "one each of x, y and z"},
           {"float y", "float x", "one each of x, y and z"},
           {"property float x", "property list uchar float v\nproperty float x", "vertices have lists"},
           {"float z", "quad z", "'quad'"},
           {"end_header", "element vertex 9\nend_header", "twice"},
           {"ascii", "morse", "format"},
           {"ascii", "binary_little_endian", "of element vertex announced"},
           {"ascii 1.0", "binary_little_endian 1.0\nelement strip 1\nproperty list uchar int i",
            "lists before its vertices"},
           {"element", "element time 1000000000\nproperty float t\nelement", "of element time announced"}})
    EXPECT_THAT(refused_ply(replaced(good, from, to)), says(message));
}

TEST_F(Clouds, WhatFollowsAPlysVerticesIsNotRead) {
  expect_ply(
      "ply\nformat ascii 1.0\nobj_info num_cols 50000\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement range_grid 4000000000\nproperty list uchar int i\nend_header\n1 2 3\n",
      {{1, 2, 3}});
}

TEST_F(Clouds, PcdFieldsThatTakeNoRoomOrPadAreSkipped) {
  const std::string head =
      "VERSION 0.7\nFIELDS x _ y z _ ring _ t\nSIZE 4 1 4 4 1 1 3 4\nTYPE F U F F U U U U\n"
      "COUNT 1 3 1 1 0 1 2 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA binary\n";
  const std::string pad3(3, '\xff'), pad6(6, '\xff');
  const auto row = [&](float x, float y, float z) {
    return bytes_of(x) + pad3 + bytes_of(y, z) + bytes_of(std::uint8_t{7}) + pad6 + bytes_of(9u);
  };
  expect_pcd(head + row(1, 2, 3) + row(4, 5, 6), {{1, 2, 3}, {4, 5, 6}});
}

TEST_F(Clouds, ACountOfZeroIsOneValueWhereTheSizeOfTheDataSaysSo) {
  const std::string head =
      "VERSION 0.7\nFIELDS intensity x y z ring\nSIZE 4 4 4 4 2\nTYPE F F F F U\nCOUNT 0 0 0 0 0\n"
      "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ";
  const std::uint16_t ring = 3;
  const std::vector<Eigen::Vector3f> expected{{1, 2, 3}, {4, 5, 6}};
  expect_pcd(head + "binary\n" + bytes_of(.5f, 1.f, 2.f, 3.f, ring) + bytes_of(.5f, 4.f, 5.f, 6.f, ring),
             expected);
  expect_pcd(head + "binary\n" + bytes_of(1.f, 2.f, 3.f, 4.f, 5.f, 6.f), expected);
  expect_pcd(head + "ascii\n0.5 1 2 3 9\n0.5 4 5 6 9\n", expected);
}

/// Readings of a box of 20 × 8 × 4 m with the sensor 1 m above its floor, `floats` values each: x y z, then
/// intensity, ring, time since the scan began and two constants. Every ninth has no return.
std::vector<float> readings(std::size_t floats) {
  std::vector<std::vector<float>> rows;
  for (int ring = 0; ring < 32; ++ring)
    for (int column = 0; column < 128; ++column) {
      const double azimuth = column * 2 * std::numbers::pi / 128;
      const double elevation = (ring - 16) * 2.5 * std::numbers::pi / 180;
      const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const Eigen::Array3d wall =
          (ray.array() > 0).select(Eigen::Array3d(10, 4, 3), Eigen::Array3d(10, 4, 1));
      const double range = (wall / ray.array().abs().max(1e-9)).minCoeff();
      const Eigen::Vector3f p = (range * ray).cast<float>();
      rows.push_back({p.x(), p.y(), p.z(), 10 + static_cast<float>((37 * column + ring) % 200) / 2,
                      static_cast<float>(ring), static_cast<float>(column) / 1280, 1, 0});
      if ((ring + column) % 9 == 0) std::fill_n(rows.back().begin(), 3, 0.0f);
    }
  std::vector<float> values;
  for (const auto& row : rows)
    values.insert(values.end(), row.begin(), row.begin() + static_cast<std::ptrdiff_t>(floats));
  return values;
}

TEST_F(Clouds, VelodyneFilesOfOtherNumbersAreRefused) {
  const auto read = [](const auto& file) { read_all({file}); };
  EXPECT_THAT(refusal(read, "odd.bin", bytes_of(1.f, 2.f, 3.f, 0.5f, 1.f)), says("float32"));
  EXPECT_THAT(refusal(read, "empty.bin", ""), says("empty"));
  std::string doubles;
  for (const float value : readings(4)) doubles += bytes_of(static_cast<double>(value) * 1.0000001);
  EXPECT_THAT(failure({write("doubles.bin", doubles)}), says("float32"));
  const std::vector<float> values = readings(5);
  const std::string bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  EXPECT_THAT(failure({write("cut.bin", bytes.substr(0, bytes.size() - 4))}), says("truncated"));
  for (const std::size_t floats : {3U, 5U, 6U}) {
    std::vector<float> others = readings(floats);
    others.resize(others.size() / 4 * 4);
    const std::string whole(reinterpret_cast<const char*>(others.data()), others.size() * sizeof(float));
    EXPECT_THAT(failure({write("others.bin", whole)}), says("reflectance", "below 0", "PCD")) << floats;
  }
}

TEST_F(Clouds, CoordinatesOfASurveyAreReadLessAnOriginOfWholeMetres) {
  const auto pcd = [](const std::string& viewpoint) {
    return "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT " +
           viewpoint + "\nPOINTS 4\nDATA binary\n" + bytes_of(448001.25, 5411002.5, 120.125) +
           bytes_of(448001.25, 5411002.75, 120.0) + bytes_of(0.0, 0.0, 0.0) +
           bytes_of(448001.0, 5411002.5, 121.0);
  };
  // Without a place of the sensor: in the map's frame, about the middle.
  auto source = open_scans({write("a.pcd", pcd("0 0 0 1 0 0 0"))});
  EXPECT_EQ(source->origin(), Eigen::Vector3d(448001, 5411003, 120));
  EXPECT_THAT(source->notes().at(0), says("origin: 448001 5411003 120 m"));
  Scan scan = read_all(*source).at(0);
  EXPECT_EQ(scan.T_map_sensor.matrix(), Eigen::Matrix4d::Identity());
  expect_points(scan.points, {{.25, -.5, .125}, {.25, -.25, 0}, {nan, nan, nan}, {0, -.5, 1}});
  // A VIEWPOINT near the points is where they were seen from, here turned by 90° about z.
  source =
      open_scans({write("b.pcd", pcd("448000.5 5411002 121 0.7071067811865476 0 0 0.7071067811865476"))});
  scan = read_all(*source).at(0);
  EXPECT_EQ(source->origin(), Eigen::Vector3d(448001, 5411002, 120));
  EXPECT_TRUE(scan.T_map_sensor.translation().isApprox(Eigen::Vector3d(-.5, 0, 1)));
  EXPECT_TRUE(
      (scan.T_map_sensor * scan.points[0].cast<double>()).isApprox(Eigen::Vector3d(.25, .5, .125), 1e-6));
  EXPECT_TRUE(scan.points[0].isApprox(Eigen::Vector3f(.5, -.75, -.875), 1e-6F));
  // A stated origin; poses alone far away; another one for all scans of the run.
  const ScanSourceOptions stated{.origin = Eigen::Vector3d(448000, 5411000, 100)};
  expect_points({read_all({folder / "a.pcd"}, stated).at(0).points[0]}, {{1.25, 2.5, 20.125}});
  const auto first = write_pcd("s/1.pcd", "448000.25 5411000 120 1 0 0 0"),
             second = write_pcd("s/2.pcd", "448001.25 5411000 120 1 0 0 0");
  const auto scans = read_all({first, second});
  expect_points(scans.at(0).points, {{1, 2, 3}, {4, 5, 6}, {nan, nan, nan}});
  EXPECT_EQ(scans.at(0).T_map_sensor.translation(), Eigen::Vector3d(.25, 0, 1));
  EXPECT_EQ(scans.at(1).T_map_sensor.translation(), Eigen::Vector3d(1.25, 0, 1));
  EXPECT_THAT(failure({write("c.pcd", pcd("3 0 0 1 0 0 0"))}), says("its pose at 3 0 0"));
  EXPECT_THAT(
      failure({write("f.bin", bytes_of(448001.F, 5411002.F, 120.F, 0.F, 448002.F, 5411002.F, 120.F, 0.F))}),
      says("5411002 m from 0, are multiples of 0.5 m"));
}

class ScanGraphs : public ScanFiles {
 protected:
  /// Two scans and an edge, written by OctoMap.
  ScanGraphs() {
    auto* first = new octomap::Pointcloud();
    first->push_back(1, 2, 3);
    first->push_back(4, 5, 6);
    auto* second = new octomap::Pointcloud();
    second->push_back(7, 8, 9);
    graph.addNode(first, octomap::pose6d(1, 2, 3, 0.1, 0.2, 0.3));
    graph.addNode(second, octomap::pose6d(4, 5, 6, 0, 0, 1.5));
    graph.connectPrevious();
    file = folder / "two.graph";
    graph.writeBinary(file.string());
  }

  octomap::ScanGraph graph;
  fs::path file;
};

TEST_F(ScanGraphs, PointsAndPosesAreOctoMaps) {
  const auto scans = read_all({file});
  ASSERT_EQ(scans.size(), graph.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    octomap::ScanNode* node = graph.getNodeByID(static_cast<unsigned>(i));
    ASSERT_EQ(scans[i].points.size(), node->scan->size());
    EXPECT_EQ(scans[i].sensor, SensorKind::lidar);
    for (std::size_t k = 0; k < scans[i].points.size(); ++k) {
      const octomap::point3d expected = node->pose.transform((*node->scan)[static_cast<unsigned>(k)]);
      const Eigen::Vector3d p = scans[i].T_map_sensor * scans[i].points[k].cast<double>();
      EXPECT_LT((p - Eigen::Vector3d(expected.x(), expected.y(), expected.z())).norm(), 1e-5);
    }
  }
  EXPECT_THAT(scans[1].name, says("two.graph scan 1"));
}

TEST_F(ScanGraphs, IsKnownByContentAndReadFromAFolder) {
  fs::rename(file, folder / "scans.dat");
  EXPECT_FALSE(is_occupancy_map(folder / "scans.dat"));
  EXPECT_EQ(read_all({folder}).size(), 2u);
}

TEST_F(ScanGraphs, TruncatedOrHostileFilesAreRefused) {
  const std::string whole = read_file(file);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THAT(failure({write("cut.graph", whole.substr(0, length))}), says("cut.graph")) << length;
  for (const std::size_t count : {std::size_t{0}, std::size_t{4}}) {  // of scans, of points
    std::string hostile = whole;
    hostile.replace(count, 4, bytes_of(0xffffffffu));
    EXPECT_THAT(failure({write("bad.graph", hostile)}), says("truncated"));
  }
  EXPECT_THAT(failure({write("bad.graph", whole + "x")}), says("not a scan graph"));
  EXPECT_THAT(failure({write("bad.graph", bytes_of(0u, 0u))}), says("without scans"));
}

TEST_F(ScanGraphs, NotRigidIsRefusedAndPosesFromOutsideAreWrongUse) {
  std::string bytes = read_file(file);
  const std::size_t quaternion = 4 + 4 + 2 * 28 + 28 + 4;
  bytes.replace(quaternion, 8, bytes_of(5.0));
  EXPECT_THAT(failure({write("bad.graph", bytes)}), says("bad.graph scan 0: pose is not a rigid motion"));
  ScanSourceOptions options = with_poses(write("p", identity_pose));
  EXPECT_THROW(open_scans({file}, options), Error);
}

}  // namespace
}  // namespace octosurf::test
