#include "io/readers/scan_files.hpp"
#include "support/paths.hpp"

#include <octomap/octomap.h>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;

// Expected numbers are those of the data's own README files.
class RealScans : public ScanFiles {
 protected:
  void SetUp() override {
    if (!fs::is_directory(data)) GTEST_SKIP() << "no ../shared/data";
  }

  const fs::path data = test::paths::data();
};

TEST_F(RealScans, RedKitchen) {
  const auto source = open_scans({data / "rgbd_7scenes_redkitchen"});
  ASSERT_EQ(source->size(), 300u);
  double path = 0;
  std::optional<Scan> before;
  for (std::size_t i = 0; i < 300; ++i) {
    auto scan = source->next();
    ASSERT_TRUE(scan);
    EXPECT_GE(scan->points.size(), 0.85 * 640 * 480) << scan->name;
    EXPECT_EQ(scan->sensor, SensorKind::depth_camera);
    for (std::size_t k = 0; k < scan->points.size(); k += 997) {
      EXPECT_GE(scan->points[k].z(), 0.8f);
      EXPECT_LE(scan->points[k].z(), 3.61f);
    }
    if (before) path += (scan->T_map_sensor.translation() - before->T_map_sensor.translation()).norm();
    before = std::move(scan);
  }
  EXPECT_FALSE(source->next());
  EXPECT_NEAR(path, 2.1, 0.05);
  EXPECT_DOUBLE_EQ(before->stamp_s, 299.0 / 30);
}

TEST_F(RealScans, SlambookPgm) {
  const fs::path images = data / "rgbd_slambook2_ch5";
  ScanSourceOptions options{.poses = images / "pose.txt",
                            .intrinsics = write("camera.txt", "518 519 325.5 253.5\n")};
  for (int stated = 1; stated >= 0; --stated, options.poses.reset()) {
    const auto scans = read_all({images}, options);
    ASSERT_EQ(scans.size(), 5u);
    EXPECT_NEAR(scans[4].T_map_sensor.translation().z(), 1.6215, 1e-6);
    for (const auto& scan : scans) EXPECT_GT(scan.points.size(), 100000u);
  }
}

TEST_F(RealScans, BalmLidar) {
  const fs::path balm = data / "lidar_balm_realworld";
  for (const fs::path& input : {balm, balm / "scans"}) {
    const auto scans = read_all({input}, with_poses(balm / "poses_subset.csv"));
    ASSERT_EQ(scans.size(), 14u);
    double path = 0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      EXPECT_GE(scans[i].points.size(), 65000u);
      EXPECT_LE(scans[i].points.size(), 88999u);
      EXPECT_EQ(scans[i].sensor, SensorKind::lidar);
      if (i == 0) continue;
      EXPECT_NEAR(scans[i].stamp_s - scans[i - 1].stamp_s, 2.5, 0.2);
      path += (scans[i].T_map_sensor.translation() - scans[i - 1].T_map_sensor.translation()).norm();
    }
    EXPECT_GT(path, 5);
    EXPECT_LT(path, 27.6);  // of all 177 scans
  }
  EXPECT_THAT(failure({balm}, with_poses(balm / "alidarPose.csv")), says("177 poses for 14 scans"));
}

TEST_F(RealScans, LabelledFrames) {
  const auto frames = read_all({data / "labelled_mosd/setup_A"});
  ASSERT_EQ(frames.size(), 8u);
  for (const auto& frame : frames) {
    EXPECT_EQ(frame.points.size(), 640u * 480u);
    EXPECT_GT(readings(frame), 50000u);
    EXPECT_LT(readings(frame), 640u * 480u);
  }
  const auto b = read_all({data / "labelled_mosd/setup_B"});
  ASSERT_EQ(b.size(), 4u);
  EXPECT_THAT(b[0].name, ::testing::EndsWith("learn3.pcd"));
  EXPECT_EQ(read_all({data / "labelled_synpeb_sample"})[0].points.size(), 250000u);

  const fs::path living_room = data / "labelled_evops_icl";
  const auto icl =
      read_all({living_room}, {.intrinsics = living_room / "ICL_living_room.K",  // fy < 0: y is up
                               .depth_scale = 5000});
  ASSERT_EQ(icl.size(), 1u);
  EXPECT_GT(icl[0].points.size(), 300000u);
  EXPECT_GT(icl[0].points.front().y(), 0);
  EXPECT_LT(icl[0].points.back().y(), 0);
}

TEST_F(RealScans, StaticClouds) {
  const fs::path clouds = data / "static_clouds";
  const auto one = [&](const char* name) { return read_all({clouds / name}).at(0); };
  EXPECT_EQ(readings(one("pcl_table_scene_mug_stereo_textured.pcd")), 209280u);
  EXPECT_EQ(one("pcl_room_scan1.pcd").points.size(), 112586u);
  EXPECT_EQ(one("open3d_fragment.pcd").points.size(), 113662u);
  EXPECT_EQ(one("pcl_region_growing_tutorial.pcd").points.size(), 108104u);
  const Scan building = one("cgal_building.ply");
  EXPECT_EQ(building.points.size(), 100000u);
  const Eigen::Vector3f above = building.T_map_sensor.translation().cast<float>();  // where it is seen from
  EXPECT_LT((building.points[0] + above - Eigen::Vector3f(8.19821f, -21.7553f, 7.88123f)).norm(), 1e-4);
  Eigen::AlignedBox3f extent;
  for (const Eigen::Vector3f& p : building.points) extent.extend(p);
  EXPECT_NEAR(extent.sizes().y(), 54.8378, 1e-3);  // by awk
  EXPECT_TRUE(is_occupancy_map(clouds / "octomap_geb079.bt"));
  EXPECT_THAT(failure({clouds / "octomap_scan.dat.bz2"}), says("not a kind of file"));

  const fs::path graph = clouds / "octomap_spherical_scan.graph";
  const Scan sphere = read_all({graph}).at(0);
  octomap::ScanGraph reference;
  reference.readBinary(graph.string());
  ASSERT_EQ(sphere.points.size(), 10201u);
  for (std::size_t i = 0; i < sphere.points.size(); ++i) {
    EXPECT_NEAR(sphere.points[i].norm(), 4.01, 0.01);
    const auto& p = (*(*reference.begin())->scan)[static_cast<unsigned>(i)];
    EXPECT_EQ(sphere.points[i], Eigen::Vector3f(p.x(), p.y(), p.z()));
  }
}

}  // namespace
}  // namespace octosurf::test
