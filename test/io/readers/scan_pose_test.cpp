#include "io/readers/pose_file.hpp"
#include "io/readers/scan_files.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <numbers>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;

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
    try {
      for (const auto& pose : io::read_poses(write("poses.txt", text)).poses) io::rigid(pose.T, pose.where);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data);
      return error.what();
    }
    ADD_FAILURE() << "not refused: " << text;
    return {};
  }
};

TEST_F(PoseFiles, FormatsAreToldApartByTheirColumns) {
  expect_quarter_turns("1 2 3 0 0 0.70710678 0.70710678\n", 1, false);
  expect_quarter_turns("17.5 1 2 3 0 0 0.70710678 0.70710678\n18 1 2 3 0 0 0.70710678 0.70710678", 2, true);
  expect_quarter_turns("0 -1 0 1 1 0 0 2 0 0 1 3\n", 1, false);
  expect_quarter_turns("0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n", 1, false);
  expect_quarter_turns("0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n\n0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n", 2,
                       false);
}

TEST_F(PoseFiles, CommasTrailingCommasCommentsBlankLinesAndForeignLineEndsAreRead) {
  expect_quarter_turns("\xEF\xBB\xBF# tx ty tz q\r\n\r\n  1,2,3, 0,0,0.70710678,0.70710678,  # first\r\n", 1,
                       false);
  expect_quarter_turns("0,-1,0,1,\n1,0,0,2,\n0,0,1,3,\n0,0,0,1,", 1, false);
  expect_quarter_turns("+1\t2e0\t3.0\t0\t0\t.70710678\t0.70710678", 1, false);
}

TEST_F(PoseFiles, LastRowMayCarryATimeStamp) {
  expect_quarter_turns("0,-1,0,1,\n1,0,0,2,\n0,0,1,3,\n0,0,0,1630577769.5,\n", 1, true);
  EXPECT_DOUBLE_EQ(*io::read_poses(folder / "poses.txt").poses[0].stamp_s, 1630577769.5);
}

TEST_F(PoseFiles, SmallDeviationsAreMadeOrthonormal) {
  const io::PoseFile file = io::read_poses(write("poses.txt", "0.0004 -1.0003 0 1 1 0 0 2 0 0 0.9998 3\n"));
  const Eigen::Matrix3d R = io::rigid(file.poses[0].T, "").linear();
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((R - quarter_turn().linear()).norm(), 1e-3);
}

TEST_F(PoseFiles, QuaternionsNearUnitLengthAreNormalised) {
  expect_quarter_turns("1 2 3 0 0 0.713 0.713\n", 1, false);
  EXPECT_THAT(refusal("1 2 3 0 0 0.72 0.72\n"), HasSubstr("not a rigid motion"));
  EXPECT_THAT(refusal("1 2 3 0 0 0 0\n"), HasSubstr("not a rigid motion"));
}

TEST_F(PoseFiles, WhatIsNoPoseIsNamedWithItsLine) {
  EXPECT_THAT(refusal("# only a comment\n"), HasSubstr("poses.txt: holds no poses"));
  EXPECT_THAT(refusal("0 0 0 0 0 0 1\n\n0 0 0 0 0 x1 1\n"), HasSubstr("poses.txt:3: 'x1' is not a number"));
  EXPECT_THAT(refusal("0 0 0 0 0 0 1\n0 0 0 0 0 0\n"), HasSubstr("poses.txt:2: 6 numbers where 7"));
  EXPECT_THAT(refusal("1 2 3\n"), HasSubstr("poses.txt:1: 3 numbers are no pose"));
  EXPECT_THAT(refusal("1 0 0 0\n0 1 0 0\n0 0 1 0\n"), HasSubstr("poses.txt:1: a 4x4 pose breaks off"));
  EXPECT_THAT(refusal("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 2 1\n"), HasSubstr("last row"));
  EXPECT_THAT(refusal("nan 0 0 0 0 0 0 1\n"), HasSubstr("time stamp is not finite"));
}

TEST_F(PoseFiles, NotRigidIsRefused) {
  EXPECT_THAT(refusal("2 0 0 0 0 2 0 0 0 0 2 0\n"), HasSubstr("poses.txt:1: pose is not a rigid motion"));
  EXPECT_THAT(refusal("1 0 0 0 0 1 0 0 0 0 -1 0\n"), HasSubstr("not a rigid motion"));  // mirrored
  EXPECT_THAT(refusal("inf 0 0 0 0 0 1\n"), HasSubstr("not finite"));
}

TEST_F(PoseFiles, TrajectoryIsInterpolatedAcrossSmallGapsOnly) {
  // A quarter turn and 1 m in 0.1 s, then nothing for a second.
  const io::Trajectory trajectory(io::read_poses(write("poses.txt",
                                                       "10.1 1 0 0 0 0 0.70710678 0.70710678\n"
                                                       "10.0 0 0 0 0 0 0 1\n"
                                                       "11.1 5 0 0 0 0 0 1\n")));
  const Eigen::Isometry3d half = trajectory.at(10.05, "scan");
  EXPECT_NEAR(half.translation().x(), 0.5, 1e-9);
  EXPECT_NEAR(Eigen::AngleAxisd(half.linear()).angle(), std::numbers::pi / 4, 1e-6);
  EXPECT_NEAR(trajectory.at(10.1, "scan").translation().x(), 1, 1e-9);
  EXPECT_NEAR(trajectory.at(10.115, "scan").translation().x(), 1, 1e-9);  // the nearest
  EXPECT_NEAR(trajectory.at(11.085, "scan").translation().x(), 5, 1e-9);
  EXPECT_TRUE(trajectory.covers(9.99));
  EXPECT_FALSE(trajectory.covers(9.97));
  EXPECT_FALSE(trajectory.covers(10.5));
  EXPECT_FALSE(trajectory.covers(12));
}

}  // namespace
}  // namespace octosurf::test
