#include "io/readers/scan_files.hpp"
#include "io/readers/scan_list.hpp"

namespace octosurf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using ScanFolders = ScanFiles;

const ScanSourceOptions skipping_bad{.skip_bad = true};

std::vector<std::string> names(const std::vector<Scan>& scans) {
  std::vector<std::string> result;
  for (const auto& scan : scans) result.push_back(std::filesystem::path(scan.name).filename().string());
  return result;
}

TEST_F(ScanFolders, SevenScenes) {
  for (const auto* place : {"", "frames/"}) {
    std::filesystem::remove_all(folder);
    write("camera-intrinsics.txt", "2 0 0\n0 2 0\n0 0 1\n");
    write("gravity-direction.txt", "0 0 1\n");
    for (int i = 0; i < 2; ++i) {
      const std::string frame = place + std::string("frame-00000") + std::to_string(i);
      write_png(frame + ".depth.png", 2, 1, {1000, 65535});
      write_picture(frame + ".color.png", true);
      write(frame + ".pose.txt", "1 0 0 " + std::to_string(i) + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    }
    const auto source = open_scans({folder});
    EXPECT_EQ(source->size(), 2u);
    const auto scans = read_all(*source);
    ASSERT_EQ(scans.size(), 2u);
    EXPECT_THAT(names(scans), ElementsAre("frame-000000.depth.png", "frame-000001.depth.png"));
    EXPECT_THAT(scans[1].points, ElementsAre(Eigen::Vector3f(0, 0, 1)));
    EXPECT_EQ(scans[1].T_map_sensor.translation(), Eigen::Vector3d(1, 0, 0));
    EXPECT_EQ(scans[1].sensor, SensorKind::depth_camera);
    EXPECT_DOUBLE_EQ(scans[1].stamp_s, 1.0 / 30);
    EXPECT_THAT(source->skipped(), IsEmpty());
  }
}

TEST_F(ScanFolders, SkippedScansAreNotDecodedAndLeaveTheOthersTimesAsTheyAre) {
  for (const char* recording : {"a", "b"})
    for (int i = 0; i < 4; ++i)
      write_pcd(recording + std::string("/") + std::to_string(i) + ".pcd", "1 0 0 1 0 0 0");
  const std::vector<std::filesystem::path> inputs{folder / "a", folder / "b"};
  const std::vector<Scan> all = read_all(inputs);
  ASSERT_EQ(all.size(), 8u);
  write("a/2.pcd", "no cloud");
  for (const std::size_t skipped : {3u, 4u, 6u}) {
    const auto source = open_scans(inputs);
    ASSERT_TRUE(source->skip(skipped));
    const std::vector<Scan> rest = read_all(*source);
    ASSERT_EQ(rest.size(), all.size() - skipped);
    for (std::size_t i = 0; i < rest.size(); ++i) {
      EXPECT_EQ(rest[i].name, all[skipped + i].name);
      EXPECT_DOUBLE_EQ(rest[i].stamp_s, all[skipped + i].stamp_s) << rest[i].name;
    }
  }
  EXPECT_FALSE(open_scans(inputs)->skip(9));
  const auto source = open_scans(inputs, skipping_bad);
  ASSERT_TRUE(source->skip(2));
  EXPECT_EQ(source->next().value().name, all[3].name) << "only good ones count";
}

TEST_F(ScanFolders, Tum) {
  write(
      "depth.txt",
      "# depth maps\n# timestamp filename\n9.0 depth/9.0.png\n10.0 depth/10.0.png\n10.05 depth/10.05.png\n");
  write("groundtruth.txt", "# tx ty tz q\n10.0 1 0 0 0 0 0 1\n10.1 2 0 0 0 0 0 1\n");
  for (const auto* name : {"depth/9.0.png", "depth/10.0.png", "depth/10.05.png"})
    write_png(name, 1, 1, {5000});
  const auto source = open_scans({folder});
  EXPECT_EQ(source->size(), 2u);
  EXPECT_THAT(source->skipped(), ElementsAre(says("9.0.png: no pose at its time")));
  const auto scans = read_all(*source);
  EXPECT_THAT(stamps(scans), ElementsAre(10.0, 10.05));
  EXPECT_NEAR(scans[1].T_map_sensor.translation().x(), 1.5, 1e-6);
  // 5000 units per metre, 525 525 319.5 239.5.
  EXPECT_LT((scans[0].points[0] - Eigen::Vector3f(-319.5f / 525, -239.5f / 525, 1)).norm(), 1e-6);

  // The folder of the images alone is known for what it is, and an intrinsics file wins.
  write("camera-intrinsics.txt", unit_camera);
  const auto depth_only = read_all({folder / "depth"});
  ASSERT_THAT(depth_only, SizeIs(2));
  EXPECT_THAT(depth_only[0].points, ElementsAre(Eigen::Vector3f(0, 0, 1)));

  write("groundtruth.txt", "900.0 1 0 0 0 0 0 1\n");
  EXPECT_THAT(failure({folder}), says("no scan has a pose at its time"));
  std::filesystem::remove(folder / "groundtruth.txt");
  EXPECT_THAT(failure({folder}), says("without poses"));
}

TEST_F(ScanFolders, IntrinsicsMayLieAbove) {
  write("camera-intrinsics.txt", unit_camera);
  write_png("seq/frame-0.depth.png", 1, 1, {1000});
  write("seq/frame-0.pose.txt", identity_pose);
  for (const char* input : {"seq", "seq/", "seq/frame-0.depth.png"})
    EXPECT_THAT(read_all({folder / input}), SizeIs(1)) << input;
}

/// slerp() at its end gives the end but for rounding.
TEST_F(ScanFolders, APoseOfTheVeryTimeIsTakenToTheBit) {
  auto random = rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::string stamped, plain, index;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector4d q =
        Eigen::Vector4d(uniform(random), uniform(random), uniform(random), 2).normalized();
    std::ostringstream pose;
    pose.precision(17);
    pose << uniform(random) << " 0 0 " << q.transpose() << "\n";
    plain += pose.str();
    stamped += std::to_string(10 + i) + ".03 " + pose.str();
    index += std::to_string(10 + i) + ".03 depth/" + std::to_string(10 + i) + ".03.png\n";
    write_png("depth/" + std::to_string(10 + i) + ".03.png", 1, 1, {5000});
  }
  write("depth.txt", index);
  write("groundtruth.txt", stamped);
  const auto by_time = read_all({folder}),
             in_order = read_all({folder}, with_poses(write("elsewhere/poses", plain)));
  ASSERT_EQ(by_time.size(), in_order.size());
  for (std::size_t i = 0; i < by_time.size(); ++i)
    EXPECT_EQ(by_time[i].T_map_sensor.matrix(), in_order[i].T_map_sensor.matrix()) << i;
}

TEST_F(ScanFolders, AnyDepthImagesWithPosesIntrinsicsAndScale) {
  write_two_images();
  const auto scans = read_all({folder}, {.poses = write("elsewhere/p", "0 0 0 0 0 0 1\n7 0 0 0 0 0 1\n"),
                                         .intrinsics = write("elsewhere/k", unit_camera),
                                         .depth_scale = 500});
  ASSERT_THAT(scans, SizeIs(2));
  EXPECT_THAT(scans[0].points, ElementsAre(Eigen::Vector3f(0, 0, 2), Eigen::Vector3f(4, 0, 4)));
  EXPECT_EQ(scans[1].T_map_sensor.translation().x(), 7);
  EXPECT_THAT(stamps(scans), ElementsAre(0, 1.0 / 30));

  // The same found beside the images.
  write("pose.txt", "3 0 0 0 0 0 1\n4 0 0 0 0 0 1\n");
  write("intrinsics.txt", unit_camera);
  EXPECT_EQ(read_all({folder})[1].T_map_sensor.translation().x(), 4);
  write("poses.txt", "3 0 0 0 0 0 1\n4 0 0 0 0 0 1\n");
  EXPECT_THAT(failure({folder}), says("holds both pose.txt and poses.txt; choose one with --poses"));
}

TEST_F(ScanFolders, AFolderOfPosesHasAFileForEachScanCalledLikeIt) {
  for (const char* const name : {"0", "1", "10"}) {
    write_png("depth/" + std::string(name) + ".png", 2, 1, {1000, 2000});
    write("pose/" + std::string(name) + ".txt",
          "1 0 0 " + std::string(name) + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  }
  write("intrinsics.txt", unit_camera);
  const auto expect_poses = [&](const std::vector<Scan>& scans) {
    EXPECT_THAT(places(scans), ElementsAre(0, 1, 10));
  };
  expect_poses(read_all({folder}));
  expect_poses(read_all({folder / "depth"}));
  std::filesystem::rename(folder / "pose", folder / "elsewhere");
  EXPECT_THAT(failure({folder}), says("without poses"));
  expect_poses(read_all({folder}, with_poses(folder / "elsewhere")));
  std::filesystem::rename(folder / "elsewhere/10.txt", folder / "elsewhere/2.txt");
  EXPECT_THAT(failure({folder}, with_poses(folder / "elsewhere")),
              says("poses from 0.txt to 2.txt, but scans from 0.png to 10.png", "10.png has none"));
  EXPECT_THAT(failure({folder}, with_poses(folder / "depth")), says("has no 0.txt"));
}

TEST_F(ScanFolders, ScansComeInNaturalOrder) {
  EXPECT_TRUE(io::natural_less("full2.pcd", "full10.pcd"));
  EXPECT_FALSE(io::natural_less("full10.pcd", "full2.pcd"));
  EXPECT_TRUE(io::natural_less("a007", "a8"));
  EXPECT_TRUE(io::natural_less("a", "a1"));
  EXPECT_TRUE(io::natural_less("a01", "a1") != io::natural_less("a1", "a01"));
  EXPECT_FALSE(io::natural_less("x", "x"));
  for (const auto* name : {"full10.pcd", "full2.pcd", "full1.pcd"}) write_pcd(name);
  EXPECT_THAT(names(read_all({folder})), ElementsAre("full1.pcd", "full2.pcd", "full10.pcd"));
}

TEST_F(ScanFolders, CloudsTakeViewpointOrPoses) {
  write_pcd("scans/1.pcd", "1 2 3 1 0 0 0");
  write_pcd("scans/2.pcd", "4 5 6 1 0 0 0");
  auto scans = read_all({folder});
  ASSERT_THAT(scans, SizeIs(2));
  EXPECT_EQ(scans[1].T_map_sensor.translation(), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(scans[1].sensor, SensorKind::lidar);
  EXPECT_THAT(stamps(scans), ElementsAre(0, 0.1));
  EXPECT_FALSE(scans[0].points[2].allFinite());

  scans = read_all({folder}, with_poses(write("poses.csv",
                                              "1,0,0,7\n0,1,0,8\n0,0,1,9\n0,0,0,100.5\n"
                                              "1,0,0,7\n0,1,0,8\n0,0,1,9\n0,0,0,101.5\n")));
  EXPECT_EQ(scans[0].T_map_sensor.translation(), Eigen::Vector3d(7, 8, 9));
  EXPECT_THAT(stamps(scans), ElementsAre(100.5, 101.5));
}

TEST_F(ScanFolders, Kitti) {
  // The scanner is 1 m ahead of the camera, axes as usual: velodyne x = camera z, y = −x, z = −y.
  write("calib.txt", "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 1\n");
  write("times.txt", "0.0\n0.5\n");
  write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 10\n");
  for (const auto* name : {"velodyne/000000.bin", "velodyne/000001.bin"})
    write(name, bytes_of(5.f, 2.f, 3.f, 0.f));
  const auto expect_moved = [](const std::vector<Scan>& scans) {
    ASSERT_THAT(scans, SizeIs(2));
    EXPECT_THAT(stamps(scans), ElementsAre(0, 0.5));
    const Eigen::Vector3d p = scans[1].T_map_sensor * scans[1].points[0].cast<double>();
    EXPECT_LT((p - Eigen::Vector3d(-2, -3, 16)).norm(), 1e-9) << p.transpose();
  };
  for (const auto& input : {folder, folder / "velodyne"}) expect_moved(read_all({input}));
  EXPECT_THAT(open_scans({folder})->notes(), testing::Contains(says("as KITTI has them", "as-given")));
  expect_moved(read_all({folder}, {.pose_form = PoseForm::of_camera}));
  const auto own = read_all({folder}, {.pose_form = PoseForm::as_given});
  EXPECT_EQ(own.at(1).T_map_sensor.linear(), Eigen::Matrix3d::Identity()) << "the scanner's";
  std::filesystem::remove(folder / "calib.txt");
  EXPECT_THAT(open_scans({folder})->notes(), testing::Contains(says("--pose-form of-camera")));
  std::filesystem::remove(folder / "poses.txt");
  EXPECT_THAT(failure({folder}), says("2 scans without poses; give --poses"));
  write("times.txt", "0.0\nnan\n");
  EXPECT_THAT(failure({folder}), says("times.txt:2: the time stamp is not finite"));
  write("times.txt", "0.0\n");
  EXPECT_THAT(failure({folder}), says("1 time stamp for 2 scans"));
}

TEST_F(ScanFolders, InputsFollowOneAnother) {
  write_pcd("a/1.pcd");
  write_pcd("a/2.pcd");
  for (const char* name : {"b/0.bin", "b/1.bin"}) write(name, bytes_of(1.f, 2.f, 3.f, 0.f));
  write("b/times.txt", "0.05\n0.35\n");
  write("b/poses.txt", std::string(identity_pose) + identity_pose);
  const auto a = folder / "a", b = folder / "b";
  const auto scans = read_all({a / "2.pcd", a / "1.pcd", b, a});
  EXPECT_THAT(names(scans), ElementsAre("2.pcd", "1.pcd", "0.bin", "1.bin", "1.pcd", "2.pcd"));
  // Time does not go back where the next input's stamps begin before.
  EXPECT_THAT(stamps(scans), testing::Pointwise(testing::DoubleEq(), {0.0, 0.1, 0.2, 0.5, 0.6, 0.7}));
  // One pose file serves all inputs.
  const auto posed = read_all(
      {a, b}, with_poses(write("p", "1 0 0 0 0 0 1\n2 0 0 0 0 0 1\n3 0 0 0 0 0 1\n4 0 0 0 0 0 1\n")));
  EXPECT_EQ(posed[2].T_map_sensor.translation().x(), 3);
  // Images of a recording are of one size.
  for (const int width : {1, 2})
    write_png("c/" + std::to_string(width) + ".png", width, 1, std::vector<std::uint16_t>(width, 1000));
  write("c/intrinsics.txt", unit_camera);
  write("c/poses.txt", std::string(identity_pose) + identity_pose);
  EXPECT_THAT(failure({folder / "c"}), says("2x1 pixels, but the images before have 1x1"));
}

TEST_F(ScanFolders, KindIsToldByContent) {
  const auto pcd = write_pcd("cloud.dat");
  EXPECT_FALSE(is_occupancy_map(pcd));
  EXPECT_THAT(read_all({pcd}), SizeIs(1));
  EXPECT_TRUE(is_occupancy_map(write("map.dat", "# Octomap OcTree binary file\nid OcTree\n")));
  EXPECT_TRUE(is_occupancy_map(write("map.ot", "# Octomap OcTree file\nid OcTree\n")));
  EXPECT_FALSE(is_occupancy_map(folder));
  EXPECT_THROW(open_scans({folder / "map.ot"}), Error);
  EXPECT_THAT(failure({folder / "missing"}), says("missing: no such file or folder"));
  EXPECT_THAT(failure({write("notes.txt", "hello")}), says("notes.txt: not a kind of file that is read"));
  EXPECT_THAT(failure({write("office.surfaces", "x")}), says("--resume"));
  EXPECT_THAT(failure({folder / "office"}), says("a saved map", "--resume"));
}

TEST_F(ScanFolders, EmptyAndUnclearFoldersAreRefused) {
  EXPECT_THAT(failure({folder}), says("holds no scans"));
  write("notes.txt", "hello");
  EXPECT_THAT(failure({folder}), says("holds no scans"));
  write_pcd("b/scans/1.pcd");
  write_pcd("a/1.pcd");
  EXPECT_THAT(failure({folder}), says("holds no scans but 2 folders: a, b; name one of them"));
  write_picture("1.png", false);
  EXPECT_THAT(failure({folder}), says("1.png", "not a 16-bit depth image"));
  write_pcd("1.pcd");
  EXPECT_THAT(read_all({folder}), SizeIs(1));  // the picture is no scan
  write_png("2.png", 1, 1, {1});
  EXPECT_THAT(failure({folder}), says("holds depth images and clouds"));
}

TEST_F(ScanFolders, WhatIsMissingOrDoesNotFitIsNamed) {
  write_two_images();
  EXPECT_THAT(failure({folder}), says("without camera intrinsics; give --intrinsics"));
  write("intrinsics.txt", unit_camera);
  EXPECT_THAT(failure({folder}), says("2 scans without poses; give --poses"));
  write("transforms.json", "{}");
  EXPECT_THAT(failure({folder}), says("2 scans without poses (transforms.json is not read: write tx"));
  EXPECT_THAT(failure({folder}, with_poses(folder / "transforms.json")),
              says("JSON", "tx ty tz qx qy qz qw"));
  EXPECT_THAT(read_all({folder / "1.png"}), SizeIs(1));  // a single image is in the map frame
  write("poses.txt", identity_pose);
  EXPECT_THAT(failure({folder}), says("poses.txt: 1 pose for 2 scans"));
  const auto three = write("elsewhere/p", std::string(identity_pose) + identity_pose + identity_pose);
  EXPECT_THAT(failure({folder}, with_poses(three)), says("3 poses for 2 scans", "--first"));
  const auto one = write("elsewhere/one", "7 0 0 0 0 0 1\n");
  EXPECT_EQ(open_scans({folder}, {.poses = one, .first = 1})->next()->T_map_sensor.translation().x(), 7);
  const auto second = open_scans({folder}, {.poses = one, .skip = 1});
  ASSERT_TRUE(second->skip(1));
  EXPECT_EQ(second->next()->T_map_sensor.translation().x(), 7);
  EXPECT_THAT(failure({folder}, with_poses(folder / "nowhere")), says("nowhere: cannot be read"));
  EXPECT_THAT(failure({folder}, {.intrinsics = write("elsewhere/k", "1 2 3")}),
              says("3 numbers are no camera intrinsics"));
}

TEST_F(ScanFolders, OptionsThatMakeNoSenseAreWrongUse) {
  write_pcd("1.pcd");
  for (const double value : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    failure(Error::Kind::usage, [&] { open_scans({folder}, {.depth_scale = value}); });
  EXPECT_THROW(open_scans({}), Error);
}

class BadScans : public ScanFiles {
 protected:
  BadScans() {
    write("intrinsics.txt", unit_camera);
    write("poses.txt", "0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n2 0 0 0 0 0 3\n3 0 0 0 0 0 1\n4 0 0 0 0 0 1\n");
    write_png("1.png", 1, 1, {1000});
    write("2.png", "");                      // empty
    write_png("3.png", 1, 1, {1000});        // its pose is not rigid
    write_png("4.png", 2, 1, {1000, 1000});  // of another size
    write_png("5.png", 1, 1, {1000});
  }
};

TEST_F(BadScans, StopTheRunWithTheirNames) {
  const auto source = open_scans({folder});
  EXPECT_TRUE(source->next());
  const auto message = [&] { return failure(Error::Kind::data, [&] { source->next(); }); };
  EXPECT_THAT(message(), says("2.png: is empty"));
  EXPECT_THAT(message(), says("3.png", "poses.txt:3", "not a rigid motion"));
  EXPECT_THAT(message(), says("4.png", "2x1", "1x1"));
}

TEST_F(BadScans, AreSkippedAndListedOnDemand) {
  const auto source = open_scans({folder}, skipping_bad);
  EXPECT_EQ(source->size(), 5u);
  const auto scans = read_all(*source);
  EXPECT_THAT(names(scans), ElementsAre("1.png", "5.png"));
  EXPECT_EQ(scans[1].T_map_sensor.translation().x(), 4);
  EXPECT_NEAR(scans[1].stamp_s, 4.0 / 30, 1e-12);  // time went on
  EXPECT_THAT(source->skipped(), ElementsAre(says("2.png"), says("3.png"), says("4.png")));
  EXPECT_FALSE(source->next());
}

TEST_F(BadScans, SetUpProblemsAreNotSkippedAndNothingGoodAtAllIsAFailure) {
  write("bad/1.pcd", "x");
  EXPECT_THAT(failure({folder / "bad"}, skipping_bad), says("none of the 1 scans is good"));
  write("poses.txt", identity_pose);
  EXPECT_THAT(failure({folder}, skipping_bad), says("1 pose for 5 scans"));
  std::filesystem::remove(folder / "intrinsics.txt");
  EXPECT_THAT(failure({folder}, skipping_bad), says("without camera intrinsics"));
}

TEST_F(BadScans, OwnPoseFileMissingOrDouble) {
  write("seven/camera-intrinsics.txt", unit_camera);
  write_png("seven/a-1.depth.png", 1, 1, {1000});
  write_png("seven/a-2.depth.png", 1, 1, {1000});
  write("seven/a-1.pose.txt", identity_pose);
  EXPECT_THAT(failure({folder / "seven"}), says("a-2.pose.txt: cannot be read"));
  write("seven/a-2.pose.txt", std::string(identity_pose) + identity_pose);
  EXPECT_THAT(failure({folder / "seven"}), says("a-2.pose.txt: 2 poses for one scan"));
  write("seven/a-2.pose.txt", "1 0 0 0\n0 -1.#IND 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(failure({folder / "seven"}), says("a-2.pose.txt:2: '-1.#IND' is not a number"));
}

}  // namespace
}  // namespace octosurf::test
