#include "io/readers/cloud_file.hpp"
#include "io/readers/scan_files.hpp"

#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <limits>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;

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
    std::string message;
    try {
      read(file);
      ADD_FAILURE() << "not refused: " << content.substr(0, 300);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data);
      message = error.what();
    }
    EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    EXPECT_THAT(message, HasSubstr(name));
    return message;
  }

  std::string refused_pcd(std::string_view content) const {
    return refusal(io::read_pcd, "bad.pcd", content);
  }
  std::string refused_ply(std::string_view content) const {
    return refusal(io::read_ply, "bad.ply", content);
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

TEST_F(Clouds, PcdOfEveryDataKindGivesPointsPoseAndOrganisation) {
  const auto cloud = organised_cloud();
  pcl::PCDWriter writer;
  const std::string file = (folder / "cloud.pcd").string();
  for (int kind = 0; kind < 3; ++kind) {
    if (kind == 0) writer.writeASCII(file, cloud);
    if (kind == 1) writer.writeBinary(file, cloud);
    if (kind == 2) writer.writeBinaryCompressed(file, cloud);
    const io::Cloud read = io::read_pcd(file);
    expect_points(read.points, points_of(cloud));
    EXPECT_TRUE(read.organised);
    EXPECT_EQ(read.T_map_sensor.translation(), Eigen::Vector3d(1, 2, 3));
    EXPECT_LT((read.T_map_sensor.linear().diagonal() - Eigen::Vector3d(1, -1, -1)).norm(), 1e-6);
  }
}

TEST_F(Clouds, PcdFieldsMayBeDoubleAndInAnyOrder) {
  const io::Cloud cloud = io::read_pcd(
      write("cloud.pcd",
            "VERSION .7\nCOLUMNS intensity z fpfh y x\nSIZE 4 8 2 8 8\nTYPE F F U F F\nCOUNT 1 1 3 1 1\n"
            "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary\n" +
                bytes_of(0.5f, 3.0, std::uint16_t{7}, std::uint16_t{8}, std::uint16_t{9}, 2.0, 1.0) +
                bytes_of(0.5f, 6.0, std::uint16_t{7}, std::uint16_t{8}, std::uint16_t{9}, 5.0, 4.0)));
  expect_points(cloud.points, {{1, 2, 3}, {4, 5, 6}});
  EXPECT_FALSE(cloud.organised);
  EXPECT_TRUE(cloud.T_map_sensor.isApprox(Eigen::Isometry3d::Identity()));
}

TEST_F(Clouds, CoordinatesThatAreNotFiniteAndTheOriginAreNoReading) {
  const std::string text = replaced(test::content(write_pcd("a.pcd")), "1 2 3\n4 5 6", "0 0 0\n1 inf 2");
  expect_points(io::read_pcd(write("b.pcd", text)).points,
                {{nan, nan, nan}, {nan, nan, nan}, {nan, nan, nan}});
}

TEST_F(Clouds, TruncatedPcdsAreRefused) {
  pcl::PCDWriter writer;
  const std::string file = (folder / "cloud.pcd").string();
  for (int kind = 0; kind < 3; ++kind) {
    if (kind == 0) writer.writeASCII(file, organised_cloud());
    if (kind == 1) writer.writeBinary(file, organised_cloud());
    if (kind == 2) writer.writeBinaryCompressed(file, organised_cloud());
    const std::string whole = test::content(file);
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{30}, std::size_t{150}, whole.size() / 2, whole.size() - 40})
      refused_pcd(whole.substr(0, length));
  }
}

TEST_F(Clouds, PcdHeadersAreNotBelieved) {
  const std::string good = test::content(write_pcd("good.pcd"));
  EXPECT_THAT(refused_pcd(replaced(replaced(replaced(good, "WIDTH 3", "WIDTH 0"), "POINTS 3", "POINTS 0"),
                                   "1 2 3\n", "")),
              HasSubstr("without points"));
  EXPECT_THAT(
      refused_pcd(replaced(replaced(good, "WIDTH 3", "WIDTH 100000000"), "POINTS 3", "POINTS 100000000")),
      HasSubstr("3 of 100000000 points"));
  EXPECT_THAT(
      refused_pcd(replaced(replaced(good, "WIDTH 3", "WIDTH 4000000000"), "HEIGHT 1", "HEIGHT 4000000000")),
      HasSubstr("not POINTS"));
  EXPECT_THAT(refused_pcd(replaced(good, "POINTS 3", "POINTS 4")), HasSubstr("not POINTS"));
  EXPECT_THAT(refused_pcd(replaced(good, "POINTS 3", "POINTS -3")), HasSubstr("'-3'"));
  EXPECT_THAT(refused_pcd(replaced(good, "COUNT 1 1 1", "COUNT 1 1 1000000000")), HasSubstr("field 'z'"));
  EXPECT_THAT(refused_pcd(replaced(good, "SIZE 4 4 4", "SIZE 4 4 3")), HasSubstr("field 'z'"));
  EXPECT_THAT(refused_pcd(replaced(good, "SIZE 4 4 4", "SIZE 4 4")), HasSubstr("differ in length"));
  EXPECT_THAT(refused_pcd(replaced(good, "FIELDS x y z", "FIELDS x y w")), HasSubstr("x, y and z"));
  EXPECT_THAT(refused_pcd(replaced(good, "FIELDS x y z", "FIELDS x x z")), HasSubstr("x, y and z"));
  EXPECT_THAT(refused_pcd(replaced(good, "TYPE F F F", "TYPE F F U")), HasSubstr("x, y and z"));
  EXPECT_THAT(refused_pcd(replaced(good, "POINTS 3\n", "POINTS 3\nCOUNT 9 9 9\n")), HasSubstr("'COUNT'"));
  EXPECT_THAT(refused_pcd(replaced(good, "DATA ascii", "DATA sealed")), HasSubstr("DATA"));
  EXPECT_THAT(refused_pcd(replaced(good, "0 0 0 1 0 0 0", "0 0 0 1 0 0")), HasSubstr("VIEWPOINT"));
  EXPECT_THAT(refused_pcd(replaced(good, "DATA ascii", "DATA binary_compressed") + bytes_of(~0u, ~0u)),
              HasSubstr("truncated or damaged"));
  EXPECT_THAT(refused_pcd(replaced(good, "4 5 6", "4 5")), HasSubstr("bad.pcd:13: 2 values"));
  EXPECT_THAT(refused_pcd(replaced(good, "4 5 6", "4 5 six")),
              HasSubstr("bad.pcd:13: 'six' is not a number"));
}

TEST_F(Clouds, PlyOfEveryFormatGivesPoints) {
  const std::string properties =
      "element vertex 2\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  expect_points(io::read_ply(write("a.ply", "ply\nformat ascii 1.0\ncomment by hand\n" + properties +
                                                "1 2 3 9 9 9\n4 5 nan 9 9 9\n3 0 1 1\n"))
                    .points,
                {{1, 2, 3}, {4, 5, nan}});
  const std::uint8_t c = 9;
  expect_points(io::read_ply(write("b.ply", "ply\nformat binary_little_endian 1.0\n" + properties +
                                                bytes_of(1.f, 2.f, 3.0, c, c, c, 4.f, 5.f, 6.0, c, c, c) +
                                                bytes_of(std::uint8_t{3}, 0, 1, 1)))
                    .points,
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
  expect_points(io::read_ply(write("big.ply",
                                   "ply\nformat binary_big_endian 1.0\nelement time 2\nproperty double t\n"
                                   "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                                   "end_header\n" +
                                       bytes_of(0.0, 0.0) + values))
                    .points,
                {{1, 2, 3}});
}

TEST_F(Clouds, BadPlysAreRefused) {
  const std::string good =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n"
      "1 2 3\n4 5 6\n";
  io::read_ply(write("good.ply", good));
  EXPECT_THAT(refused_ply(""), HasSubstr("PLY header"));
  EXPECT_THAT(refused_ply(good.substr(0, 60)), HasSubstr("PLY header"));
  EXPECT_THAT(refused_ply(replaced(good, "vertex 2", "vertex 0")), HasSubstr("without points"));
  EXPECT_THAT(refused_ply(replaced(good, "vertex 2", "vertex 3")), HasSubstr("bad.ply"));
  EXPECT_THAT(refused_ply(replaced(good, "vertex 2", "vertex 400000000")),
              HasSubstr("2 of 400000000 points"));
  EXPECT_THAT(refused_ply(replaced(good, "vertex 2", "vertex -2")), HasSubstr("'-2'"));
  EXPECT_THAT(refused_ply(replaced(good, "4 5 6", "4 5")), HasSubstr("bad.ply:9: 2 values"));
  EXPECT_THAT(refused_ply(replaced(good, "float z", "float w")), HasSubstr("one each of x, y and z"));
  EXPECT_THAT(refused_ply(replaced(good, "float z", "int z")), HasSubstr("one each of x, y and z"));
  EXPECT_THAT(refused_ply(replaced(good, "float y", "float x")), HasSubstr("one each of x, y and z"));
  EXPECT_THAT(refused_ply(replaced(good, "end_header", "property list uchar float v\nend_header")),
              HasSubstr("lists per vertex"));
  EXPECT_THAT(refused_ply(replaced(good, "float z", "quad z")), HasSubstr("'quad'"));
  EXPECT_THAT(refused_ply(replaced(good, "end_header", "element vertex 9\nend_header")), HasSubstr("twice"));
  EXPECT_THAT(refused_ply(replaced(good, "ascii", "morse")), HasSubstr("format"));
  EXPECT_THAT(refused_ply(replaced(good, "element", "element time 1000000000\nproperty float t\nelement")),
              HasSubstr("of element time announced"));
  EXPECT_THAT(refused_ply(replaced(good, "ascii", "binary_little_endian")),
              HasSubstr("of element vertex announced"));
}

TEST_F(Clouds, WhatFollowsAPlysVerticesIsNotRead) {
  const io::Cloud cloud = io::read_ply(write(
      "a.ply",
      "ply\nformat ascii 1.0\nobj_info num_cols 50000\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement range_grid 4000000000\nproperty list uchar int i\nend_header\n1 2 3\n"));
  expect_points(cloud.points, {{1, 2, 3}});
}

TEST_F(Clouds, VelodyneIsFourFloatsAPoint) {
  const auto file = write("a.bin", bytes_of(1.f, 2.f, 3.f, 0.5f, 0.f, 0.f, 0.f, 0.f, 4.f, 5.f, 6.f, 0.1f));
  expect_points(io::read_velodyne(file).points, {{1, 2, 3}, {nan, nan, nan}, {4, 5, 6}});
  EXPECT_THAT(refusal(io::read_velodyne, "bad.bin", bytes_of(1.f, 2.f, 3.f, 0.5f, 1.f)),
              HasSubstr("float32"));
  EXPECT_THAT(refusal(io::read_velodyne, "bad.bin", ""), HasSubstr("empty"));
}

}  // namespace
}  // namespace octosurf::test
