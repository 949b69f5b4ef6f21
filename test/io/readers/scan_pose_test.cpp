// Poses and time stamps of scans, and what the Python module does not show of folders (scans_test.py).
#include "io/readers/pose_file.hpp"
#include "io/readers/scan_files.hpp"
#include "io/readers/scan_list.hpp"

#include <iomanip>

namespace octosurf::test {
namespace {

/// Quarter turn about z, then shift by (1, 2, 3).
Eigen::Isometry3d quarter_turn() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.matrix() << 0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1;
  return T;
}

class PoseFiles : public ScanFiles {
 protected:
  void expect_quarter_turns(std::string_view text, std::size_t count, bool stamped) const {
    const io::PoseFile file = io::read_poses(write("poses.txt", text));
    ASSERT_EQ(file.poses.size(), count) << text;
    EXPECT_EQ(file.stamped, stamped) << text;
    for (const auto& pose : file.poses)
      EXPECT_TRUE(io::rigid(pose.T, "").isApprox(quarter_turn(), 1e-6)) << text << '\n' << pose.T.matrix();
  }

  std::string refusal(std::string_view text) const {
    return failure(Error::Kind::data, [&] {
      for (const auto& pose : io::read_poses(write("poses.txt", text)).poses) io::rigid(pose.T, pose.where);
    });
  }
  double first_stamp() const { return io::read_poses(folder / "poses.txt").poses[0].stamp_s.value(); }
};

TEST_F(PoseFiles, FormatsAreToldApartByTheirColumns) {
  expect_quarter_turns("1 2 3 0 0 0.70710678 0.70710678\n", 1, false);
  expect_quarter_turns("17.5 1 2 3 0 0 0.70710678 0.70710678\n18 1 2 3 0 0 0.70710678 0.70710678", 2, true);
  expect_quarter_turns("0 -1 0 1 1 0 0 2 0 0 1 3\n", 1, false);
  expect_quarter_turns("0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n", 1, false);
  expect_quarter_turns("0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n\n0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n", 2,
                       false);
  expect_quarter_turns("0,17,1,2,3,0,0,0.70710678,0.70710678\n1,18,1,2,3,0,0,0.70710678,0.70710678\n", 2,
                       true);  // pandas' index
  EXPECT_EQ(first_stamp(), 17);
}

TEST_F(PoseFiles, AHeadingMaySayThatQwIsFirst) {
  const std::string turn = " 1 2 3 0.70710678 0 0 0.70710678", rest = " 1 2 3 4 5 6 7 8 9\n";
  expect_quarter_turns(
      "#timestamp [ns], p_RS_R_x [m], q_RS_w [], q_RS_x [], v_RS_R_x [m s^-1]\n17" + turn + rest, 1,
      true);  // EuRoC
  expect_quarter_turns("# by a program\n# timestamp tx ty tz qw qx qy qz\n17" + turn, 1, true);
  const auto poses = write("p.txt", "# x y z qw qx qy qz\n" + turn + "\n");
  for (const PoseForm form : {PoseForm::as_given, PoseForm::w_first})  // it is said already
    EXPECT_TRUE(read_all({write_pcd("a.pcd")}, {.poses = poses, .pose_form = form})
                    .at(0)
                    .T_map_sensor.isApprox(quarter_turn(), 1e-6));
}

TEST_F(PoseFiles, CommasTrailingCommasCommentsBlankLinesAndForeignLineEndsAreRead) {
  for (const char* const text :
       {"\xEF\xBB\xBF# tx ty tz q\r\n\r\n  1,2,3, 0,0,0.70710678,0.70710678,  # first\r\n",
        "0,-1,0,1,\n1,0,0,2,\n0,0,1,3,\n0,0,0,1,", "+1\t2e0\t3.0\t0\t0\t.70710678\t0.70710678"})
    expect_quarter_turns(text, 1, false);
}

TEST_F(PoseFiles, MatricesMayCarryATimeStamp) {
  for (const auto& [text, stamp_s] :
       {std::pair("0,-1,0,1,\n1,0,0,2,\n0,0,1,3,\n0,0,0,1630577769.5,\n", 1630577769.5),
        {"17.5 0 -1 0 1 1 0 0 2 0 0 1 3\n", 17.5},
        {"17.5 0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n", 17.5}}) {
    expect_quarter_turns(text, 1, true);
    EXPECT_DOUBLE_EQ(first_stamp(), stamp_s);
  }
}

TEST_F(PoseFiles, OfOdometriesAreReadAsTheyAreWritten) {
  const std::string at = "1.000000000 2.000000000 3.000000000 0.000000000 0.000000000 ";
  const std::string half = "0.707106781 0.707106781", exponents = "7.071067812e-01 7.071067812e-01";
  for (const std::string& text :
       {"1.700000000500000000e+09 1.0e+00 2.0e+00 3.0e+00 0 0 " + exponents,  // KISS
        "1700000000.500000 " + at + half,                                     // ORB-SLAM3, GLIM, RKO-LIO
        "1700000000500000000.000000 " + at + half,                            // ORB-SLAM3's of EuRoC
        "#timestamp x y z qx qy qz qw id\n1700000000.500000 " + at + half + " 12"}) {
    expect_quarter_turns(text + "\n", 1, true);  // the last: RTAB-Map
    EXPECT_DOUBLE_EQ(first_stamp(), 1700000000.5) << text;
  }
}

TEST_F(PoseFiles, SmallDeviationsAreMadeOrthonormal) {
  const io::PoseFile file = io::read_poses(write("poses.txt", "0.0004 -1.0003 0 1 1 0 0 2 0 0 0.9998 3\n"));
  const Eigen::Matrix3d R = io::rigid(file.poses[0].T, "").linear();
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((R - quarter_turn().linear()).norm(), 1e-3);
}

TEST_F(PoseFiles, WhatIsNoPoseIsNamedWithItsLine) {
  EXPECT_THAT(refusal("# only a comment\n"), says("poses.txt: holds no poses"));
  EXPECT_THAT(refusal("0 0 0 0 0 0 1\n\n0 0 0 0 0 x1 1\n"), says("poses.txt:3: 'x1' is not a number"));
  EXPECT_THAT(refusal("0 0 0 0 0 0 1\n0 0 0 0 0 0\n"), says("poses.txt:2: 6 numbers where 7"));
  EXPECT_THAT(refusal("1 2 3\n"), says("poses.txt:1: 3 numbers are no pose"));
  EXPECT_THAT(refusal("1 0 0 0\n0 1 0 0\n0 0 1 0\n"), says("poses.txt:1: a 4x4 pose breaks off"));
  EXPECT_THAT(refusal("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 2 1\n"), says("last row"));
}

TEST_F(PoseFiles, OnlyRigidMotionsAreTaken) {
  expect_quarter_turns("1 2 3 0 0 0.713 0.713\n", 1, false);  // near unit length
  for (const char* const bad : {"0 0 0.72 0.72", "0 0 0 0"})
    EXPECT_THAT(refusal(std::string("0 0 0 0 0 0 1\n1 2 3 ") + bad + "\n"),
                says("poses.txt:2: pose is not a rigid motion"));
  EXPECT_THAT(refusal("2 0 0 0 0 2 0 0 0 0 2 0\n"), says("poses.txt:1: pose is not a rigid motion"));
  EXPECT_THAT(refusal("1 0 0 0 0 1 0 0 0 0 -1 0\n"), says("not a rigid motion"));  // mirrored
  EXPECT_THAT(refusal("inf 0 0 0 0 0 1\n"), says("not finite"));
}

TEST_F(PoseFiles, SevenColumnsOfAnotherMeaningAreNamed) {
  const char* const expected = "7 columns whose last four are no unit quaternion";
  EXPECT_THAT(refusal("0 0 0.6 0.8 1 2 3\n0 0 0 1 4 5 6\n"),
              says(expected, "columns 1 to 4 are one: write tx ty tz qx qy qz qw"));
  EXPECT_THAT(refusal("1403636579.5 1 2 3 0.1 0.2 0.3\n"), says(expected, "time x y z roll pitch yaw"));
}

TEST_F(PoseFiles, OtherTextsAreNamed) {
  EXPECT_THAT(refusal(" {\"frames\": []}\n"), says("JSON", "not read", "tx ty tz qx qy qz qw"));
  EXPECT_THAT(refusal(std::string("\xFF\xFE"
                                  "1\0 \0",
                                  6)),
              says("is UTF-16 text", "UTF-8"));
  EXPECT_THAT(refusal("0,5 1,25 2 0 0 0,7 0,7\n"),
              says("poses.txt:1: numbers with decimal commas", "points"));
  EXPECT_THAT(refusal("17 1 2 3 0.707107 0 0 0.707107 1 2 3 4 5 6 7 8 9\n"), says("last row", "EuRoC"));
  EXPECT_THAT(refusal("timestamp,tx,ty\n"), says("'timestamp' is not a number", "headings begin with #"));
}

TEST(TimeStamps, AreFoundInNames) {
  for (const auto& [name, stamp_s] : {std::pair("1305031102.160407.png", 1305031102.160407),
                                      {"000012_1305031102.16.pcd", 1305031102.16},
                                      {"000012_-7.5.pcd", -7.5},
                                      {"12.5.pcd", 12.5},
                                      {"1403636579763555584.png", 1403636579.763555584},
                                      {"1403636579763555.pcd", 1403636579.763555},
                                      {"cloud_1403636579763555584.pcd", 1403636579.763555584},
                                      {"1403636579.pcd", 1403636579},
                                      {"cloud_1403636579763.pcd", 1403636579.763},
                                      {"frame_1403636579_063555584.pcd", 1403636579.063555584},
                                      {"depth-1403636579.7635.png", 1403636579.7635}})
    EXPECT_DOUBLE_EQ(io::stamp_in_name(name).value_or(-1), stamp_s) << name;
  for (const char* const none : {"000012.bin", "0000000010.bin", "scan12.pcd", "room_0.05.pcd", "cloud.pcd",
                                 "a_1.2.3.pcd", "20240131.png", "0403636579.pcd", "4242424242.pcd",
                                 "1403636579_763.pcd", "000012_763555584.pcd", "0000001403636579.pcd"})
    EXPECT_FALSE(io::stamp_in_name(none)) << none;
}

class TimedScans : public ScanFiles {
 protected:
  static constexpr std::int64_t first_ns = 1403636579763555584;

  /// Five clouds 0.1 s apart, called by `digits` of their time.
  void write_scans(std::int64_t divisor) const {
    for (int i = 0; i < 5; ++i)
      write_pcd("scans/" + std::to_string((first_ns + i * 100000000) / divisor) + ".pcd");
  }
  /// Poses at x = 0, 0.1, … m, one each `step_ms` from 25 ms before the first scan on, times in 1/`per_s` s.
  std::string poses(int count, int step_ms, double per_s) const {
    std::ostringstream text;
    text.precision(per_s == 1 ? 9 : 0);
    for (int i = 0; i < count; ++i)
      text << std::fixed << (static_cast<double>(first_ns) / 1e9 - 0.025 + 1e-3 * i * step_ms) * per_s << " "
           << std::setprecision(9) << 0.1 * i << " 0 0 0 0 0 1\n"
           << std::setprecision(per_s == 1 ? 9 : 0);
    return text.str();
  }
};

TEST_F(TimedScans, AreGivenThePosesOfTheirTimeWhateverTheUnits) {
  for (const std::int64_t divisor : {1, 1000}) {
    fs::remove_all(folder / "scans");
    write_scans(divisor);
    for (const double per_s : {1.0, 1e3, 1e6, 1e9}) {
      const auto source =
          open_scans({folder / "scans"}, with_poses(write("trajectory.txt", poses(20, 50, per_s))));
      EXPECT_THAT(source->notes().back(), says("5 of 5 scans matched by time"));
      // 25 ms are half a step; whole milliseconds are 1 % of a step each.
      EXPECT_THAT(places(read_all(*source)),
                  testing::Pointwise(DoubleNear(4e-3), {0.05, 0.25, 0.45, 0.65, 0.85}));
    }
  }
}

TEST_F(TimedScans, AreGivenPosesByTimeEvenIfThereAreAsMany) {
  write_scans(1);
  EXPECT_NEAR(
      places(read_all({folder / "scans"}, with_poses(write("trajectory.txt", poses(6, 95, 1))))).at(3), 0.342,
      1e-3);
}

TEST_F(TimedScans, ThatWereRoundedAreTold) {
  std::string rounded, exact, times;
  for (int i = 0; i < 4; ++i) {
    const std::string stamp = std::to_string(1403636579 + 0.25 * i);
    write_pcd("scans/" + stamp + ".pcd");
    exact += stamp + " 0 0 0 0 0 0 1\n";
    rounded += "1403636579 0 0 0 0 0 0 1\n";
    times += "1403636579\n";
  }
  const auto notes = [&](const std::string& poses) {
    return open_scans({folder / "scans"}, with_poses(write("p.txt", poses)))->notes();
  };
  EXPECT_THAT(notes(exact), Not(Contains(says("rounded"))));
  EXPECT_THAT(notes(rounded), Contains(says("p.txt: 4 poses have 1 different times, whole seconds")));
  write("scans/times.txt", times);
  EXPECT_THAT(notes(exact), Contains(says("scans: 4 scans have 1 different times, whole", "times.txt")));
}

TEST_F(TimedScans, OfNanosecondsWithoutLeadingZerosAreRefused) {
  for (const char* const name : {"1403636579.4", "1403636579.763555584"})
    write_pcd("scans/" + std::string(name) + ".pcd");
  EXPECT_THAT(failure({folder / "scans"}),
              says("without their leading zeros, such as 1403636579.4.pcd beside", "nine digits"));
}

TEST_F(TimedScans, LeaveOutBadPosesAndTellOfGaps) {
  write_scans(1);
  std::string text = poses(20, 50, 1);
  std::string::size_type line = 0;
  for (const char* const bad : {"0 0 0 0 0 0 1.014", "nan 0 0 0 0 0 1", "0 0 0 0 0 0 0"}) {
    const auto end = text.find('\n', line), blank = text.find(' ', line);
    text.insert(end + 1, text.substr(line, blank - line) + "1 " + bad + "\n");
    line = end + 1;
  }
  const auto source =
      open_scans({folder / "scans"}, with_poses(write("trajectory.txt", text + "nan 0 0 0 0 0 0 1\n")));
  EXPECT_THAT(source->notes(), Contains(says("4 poses left out, no rigid motion")));
  EXPECT_NEAR(places(read_all(*source)).at(4), 0.85, 1e-6);

  const auto sparse = write("sparse.txt", poses(5, 125, 1));  // one at the second scan's time
  EXPECT_THAT(open_scans({folder / "scans"}, with_poses(sparse))->skipped(),
              AllOf(SizeIs(4), testing::Each(says("0.125 s apart"))));
  EXPECT_THAT(failure({folder / "scans"}, with_poses(write("sparser.txt", poses(2, 500, 1)))),
              says("no scan has a pose at its time", "0.500 s apart", "at most 0.1 s apart"));
  EXPECT_THAT(failure({folder / "scans"}, with_poses(write("bad.txt", "1403636579 0 0 0 0 0 0 2\n"))),
              says("nor is any"));
}

using ScanFolders = ScanFiles;

TEST_F(ScanFolders, SkippedScansAreNotDecodedAndLeaveTheOthersTimesAsTheyAre) {
  for (const char* recording : {"a", "b"})
    for (int i = 0; i < 4; ++i)
      write_pcd(recording + std::string("/") + std::to_string(i) + ".pcd", "1 0 0 1 0 0 0");
  const std::vector<fs::path> inputs{folder / "a", folder / "b"};
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
  const auto source = open_scans(inputs, {.skip_bad = true});
  ASSERT_TRUE(source->skip(2));
  EXPECT_EQ(source->next().value().name, all[3].name) << "only good ones count";
}

TEST_F(ScanFolders, KindIsToldByContent) {
  const auto pcd = write_pcd("cloud.dat");
  EXPECT_FALSE(is_occupancy_map(pcd));
  EXPECT_THAT(read_all({pcd}), SizeIs(1));
  for (const char* head :
       {"# Octomap OcTree binary file\nid OcTree\n", "# Octomap OcTree file\nid OcTree\n"}) {
    EXPECT_TRUE(is_occupancy_map(write("map.dat", head)));
    EXPECT_THROW(open_scans({folder / "map.dat"}), Error);
  }
  EXPECT_FALSE(is_occupancy_map(folder));
  EXPECT_EQ(sensor_of_frame("camera_depth_optical_frame"), SensorKind::depth_camera);
  EXPECT_EQ(sensor_of_frame("optical_frame_of_lidar"), SensorKind::lidar);
}

}  // namespace
}  // namespace octosurf::test
