#include "io/readers/transform_tree.hpp"

#include "support/seed.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <random>

namespace octosurf::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::int64_t second = 1000000000;

io::PoseTrack::Sample sample(double stamp_s, double x, double yaw_rad = 0) {
  return {std::llround(stamp_s * 1e9), 0, {x, 0, 0}, {std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)}};
}

std::string why_not(const io::TransformTree& tree, const std::string& to, const std::string& from,
                    double stamp_s) {
  try {
    tree.lookup(to, from, std::llround(stamp_s * 1e9), second / 4);
  } catch (const io::NoPose& none) {
    return none.what();
  }
  ADD_FAILURE() << "there is a pose";
  return {};
}

TEST(PoseTrack, IsExactAtItsSamplesAndSlerpsBetween) {
  io::PoseTrack track;
  track.add(sample(1.2, 4, 1.5));
  track.add(sample(1, 2, 0.5));
  track.finish();
  EXPECT_EQ(track.at(second, 0).T_parent_child.translation().x(), 2);
  const auto middle = track.at(second * 11 / 10, second / 4).T_parent_child;
  EXPECT_NEAR(middle.translation().x(), 3, 1e-12);
  EXPECT_NEAR(std::atan2(middle(1, 0), middle(0, 0)), 1.0, 1e-9);
}

TEST(PoseTrack, OfTwoAtOneTimeTheLastOneHolds) {
  io::PoseTrack track;
  track.add(sample(1, 2));
  track.add(sample(1, 5));
  track.finish();
  EXPECT_EQ(track.at(second, 0).T_parent_child.translation().x(), 5);
}

TEST(TransformTree, IsSettledWhenNothingThatComesLaterCanChangeAnAnswer) {
  io::TransformTree tree;
  EXPECT_TRUE(tree.settled("map", "map", second));
  EXPECT_FALSE(tree.settled("map", "camera", second));
  tree.add({"base", "camera", true}, sample(0, 1));
  tree.add({"odom", "base", false}, sample(1, 1));
  EXPECT_FALSE(tree.settled("map", "camera", second));  // does not hang together yet
  tree.add({"map", "odom", false}, sample(0.9, 1));
  tree.finish();
  EXPECT_FALSE(tree.settled("map", "camera", second));
  EXPECT_TRUE(tree.settled("map", "camera", second * 9 / 10));
  EXPECT_TRUE(tree.settled("odom", "camera", second));  // what moves above does not matter
  EXPECT_FALSE(tree.settled("odom", "camera", second + 1));
  tree.add({"map", "odom", false}, sample(1.1, 1));
  tree.add({"map", "other", false}, sample(0.5, 1));
  tree.finish();
  EXPECT_TRUE(tree.settled("map", "camera", second));
  EXPECT_FALSE(tree.settled("other", "camera", second));  // up to the map, and down again
  EXPECT_TRUE(tree.settled("other", "camera", second / 2));
}

TEST(TransformTree, ForgetsWhatIsOldOfEachMovingFrame) {
  io::TransformTree tree;
  for (const double t : {1.0, 2.0, 3.0}) tree.add({"map", "base", false}, sample(t, t));
  tree.add({"map", "slow", false}, sample(1, 1));
  tree.add({"base", "camera", true}, sample(0, 0));
  tree.finish();
  tree.keep_last(second);
  EXPECT_THAT(why_not(tree, "map", "camera", 1), HasSubstr("the first is 1.000 s later"));
  EXPECT_EQ(tree.lookup("map", "camera", 2 * second, 0).translation().x(), 2);
  EXPECT_EQ(tree.lookup("map", "slow", second, 0).translation().x(), 1);
}

TEST(PoseTrack, DoesNotGuessOverGaps) {
  io::PoseTrack track;
  track.add(sample(1, 2));
  track.add(sample(1.3, 4));
  track.finish();
  EXPECT_THROW(track.at(second * 12 / 10, second / 4), io::NoPose);
  EXPECT_NO_THROW(track.at(second * 12 / 10, second / 2));
  EXPECT_EQ(track.at(second * 99 / 100, second / 4).T_parent_child.translation().x(), 2);  // 10 ms before
  EXPECT_THROW(track.at(second * 9 / 10, second / 4), io::NoPose);
  EXPECT_THROW(track.at(second * 2, second * 10), io::NoPose);
}

TEST(PoseTrack, TakesNoTimesForNear) {
  io::PoseTrack track;
  io::PoseTrack::Sample early = sample(0, 1), late = sample(0, 2);
  early.stamp_ns = std::numeric_limits<std::int64_t>::min();
  late.stamp_ns = std::numeric_limits<std::int64_t>::max();
  track.add(early);
  track.add(late);
  track.finish();
  EXPECT_THROW(track.at(0, second), io::NoPose);
}

TEST(PoseTrack, LeavesOutWhatIsNoPose) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double length : {1.014, 0.986, 0.0, nan}) {
    io::PoseTrack track;
    io::PoseTrack::Sample bad = sample(1.1, 70);
    bad.rotation.coeffs() *= length;
    track.add(sample(1, 2));
    track.add(bad);
    track.add(sample(1.2, 4));
    track.finish();
    EXPECT_EQ(track.left_out(), 1U) << length;
    EXPECT_NEAR(track.at(second * 11 / 10, second / 4).T_parent_child.translation().x(), 3, 1e-12) << length;
  }
  io::PoseTrack track;
  io::PoseTrack::Sample nowhere = sample(1.1, nan), rounded = sample(1.2, 5);
  rounded.rotation.coeffs() *= 0.9996;
  track.add(sample(1.1, 3));
  track.add(nowhere);  // at the same time
  track.add(rounded);
  track.finish();
  EXPECT_EQ(track.left_out(), 1U);
  EXPECT_EQ(track.at(second * 11 / 10, second / 4).T_parent_child.translation().x(), 3);
  EXPECT_EQ(track.at(second * 12 / 10, second / 4).T_parent_child.translation().x(), 5);
}

TEST(TransformTree, ABadFixedTransformReplacesNoGoodOne) {
  io::TransformTree tree;
  tree.add({"base", "lidar", true}, sample(1, 2));
  tree.add({"base", "lidar", true}, sample(2, std::numeric_limits<double>::infinity()));
  tree.finish();
  EXPECT_EQ(tree.lookup("base", "lidar", second, 0).translation().x(), 2);
}

TEST(PoseTrack, RefusesWhatIsNoRotation) {
  io::PoseTrack track;
  io::PoseTrack::Sample bad = sample(1, 0);
  bad.rotation = {2, 0, 0, 0};
  track.add(bad);
  track.finish();
  EXPECT_THROW(track.at(second, 0), std::runtime_error);
}

TEST(TransformTree, GoesUpAndAcross) {
  io::TransformTree tree;
  tree.add({"map", "odom", false}, sample(1, 10));
  tree.add({"odom", "base", false}, sample(1, 1));
  tree.add({"base", "left", true}, sample(0, 0.1));
  tree.add({"base", "right", true}, sample(0, -0.1));
  tree.finish();
  EXPECT_NEAR(tree.lookup("map", "left", second, 0).translation().x(), 11.1, 1e-12);
  EXPECT_NEAR(tree.lookup("right", "left", second, 0).translation().x(), 0.2, 1e-12);
  EXPECT_NEAR(tree.lookup("left", "map", second, 0).translation().x(), -11.1, 1e-12);
  EXPECT_THAT(tree.ancestors("left"), ElementsAre("left", "base", "odom", "map"));
  EXPECT_TRUE(tree.moves("left"));
  // Fixed to one another, whatever is known of where both are.
  EXPECT_NEAR(tree.lookup("right", "left", 99 * second, 0).translation().x(), 0.2, 1e-12);
  EXPECT_THAT(why_not(tree, "map", "left", 99),
              HasSubstr("no pose of frame base at its time: the last is 98"));
}

TEST(TransformTree, TellsWhatIsMissing) {
  io::TransformTree tree;
  tree.add({"map", "base", false}, sample(1, 10));
  tree.add({"world", "camera", true}, sample(0, 1));
  tree.finish();
  EXPECT_THAT(why_not(tree, "map", "lidar", 1), HasSubstr("no frame 'lidar'"));
  EXPECT_THAT(why_not(tree, "earth", "base", 1), HasSubstr("no frame 'earth'"));
  EXPECT_THAT(why_not(tree, "map", "camera", 1), HasSubstr("does not connect camera with map"));
}

TEST(TransformTree, ARobotIsWhatAloneMovesInItsMap) {
  io::TransformTree tree;
  tree.add({"camera_init", "body", false}, sample(1, 0));
  tree.add({"map", "odom", false}, sample(1, 0));
  tree.add({"odom", "base", false}, sample(1, 0));
  tree.add({"base", "lidar", true}, sample(1, 0));
  tree.add({"base", "leg_1", false}, sample(1, 0));
  tree.add({"base", "leg_2", false}, sample(1, 0));
  tree.add({"world", "drone", false}, sample(1, 0));
  tree.add({"world", "gate", true}, sample(1, 0));
  tree.add({"drone", "mount", true}, sample(1, 0));
  tree.add({"mount", "scanner", true}, sample(1, 0));
  tree.add({"earth", "alice", false}, sample(1, 0));
  tree.add({"earth", "bob", false}, sample(1, 0));
  tree.finish();
  EXPECT_EQ(tree.robot_below("camera_init"), "body");
  EXPECT_EQ(tree.robot_below("map"), "base");
  EXPECT_EQ(tree.robot_below("odom"), "base");
  EXPECT_EQ(tree.robot_below("world"), "scanner");
  EXPECT_EQ(tree.robot_below("earth"), "");
  EXPECT_EQ(tree.robot_below("gate"), "");
  EXPECT_EQ(tree.robot_below("nowhere"), "");
}

TEST(TransformTree, RingsEnd) {
  io::TransformTree tree;
  tree.add({"a", "b", true}, sample(0, 1));
  tree.add({"b", "a", true}, sample(0, 1));
  tree.add({"c", "c", true}, sample(0, 1));
  tree.finish();
  EXPECT_THAT(why_not(tree, "c", "a", 1), HasSubstr("ring"));
  EXPECT_FALSE(tree.moves("a"));
  EXPECT_LE(tree.ancestors("a").size(), 4U);
}

TEST(TransformTree, AChangeOfParentIsAGap) {
  io::TransformTree tree;
  tree.add({"map", "box", false}, sample(1, 1));
  tree.add({"hand", "box", false}, sample(1.1, 0));
  tree.add({"map", "hand", true}, sample(0, 5));
  tree.finish();
  EXPECT_EQ(tree.lookup("map", "box", second, second).translation().x(), 1);
  EXPECT_EQ(tree.lookup("map", "box", second * 11 / 10, second).translation().x(), 5);
  EXPECT_THAT(why_not(tree, "map", "box", 1.05), HasSubstr("parent changes"));
}

/// The slow twin: a chain's poses multiplied one by one.
TEST(TransformTree, EqualsTheProductOfItsEdges) {
  auto random = rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  io::TransformTree tree;
  Eigen::Isometry3d product = Eigen::Isometry3d::Identity();
  std::string parent = "0";
  for (int depth = 1; depth <= 8; ++depth) {
    const std::string child = std::to_string(depth);
    io::PoseTrack::Sample one = sample(1, 0);
    one.translation = {uniform(random), uniform(random), uniform(random)};
    Eigen::Quaterniond q(uniform(random), uniform(random), uniform(random), 2);
    q.normalize();
    one.rotation = Eigen::Quaternion<double, Eigen::DontAlign>(q);
    tree.add({parent, child, depth % 3 == 0}, one);
    product = product * Eigen::Translation3d(one.translation) * q;
    parent = child;
  }
  tree.finish();
  EXPECT_TRUE(tree.lookup("0", "8", second, 0).isApprox(product, 1e-12));
  EXPECT_TRUE(tree.lookup("8", "0", second, 0).isApprox(product.inverse(), 1e-12));
}

}  // namespace
}  // namespace octosurf::test
