#include "io/readers/transform_tree.hpp"

#include "io/readers/scan_files.hpp"

namespace octosurf::test {
namespace {

using ::testing::ElementsAre;

constexpr std::int64_t second = 1000000000;

io::Trajectory::Sample sample(double stamp_s, double x, double yaw_rad = 0) {
  return {std::llround(stamp_s * 1e9), {x, 0, 0}, {std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)}};
}

std::string why_not(const io::TransformTree& tree, const std::string& to, const std::string& from,
                    double stamp_s) {
  try {
    tree.lookup(to, from, std::llround(stamp_s * 1e9), second / 4);
  } catch (const io::NoPose& none) {
    return none.what();
  }
  return "there is a pose";
}

/// Edges of parent, child, whether it is fixed, and x m at a time in s.
struct Edge {
  const char *parent, *child;
  bool fixed;
  double stamp_s, x;
};
void add(io::TransformTree& tree, std::initializer_list<Edge> edges) {
  for (const Edge& edge : edges)
    tree.add({edge.parent, edge.child, edge.fixed}, sample(edge.stamp_s, edge.x));
  tree.finish();
}

TEST(TransformTree, IsSettledWhenNothingThatComesLaterCanChangeAnAnswer) {
  io::TransformTree tree;
  EXPECT_TRUE(tree.settled("map", "map", second));
  EXPECT_FALSE(tree.settled("map", "camera", second));
  add(tree, {{"base", "camera", true, 0, 1}, {"odom", "base", false, 1, 1}});
  EXPECT_FALSE(tree.settled("map", "camera", second));  // does not hang together yet
  add(tree, {{"map", "odom", false, 0.9, 1}});
  EXPECT_FALSE(tree.settled("map", "camera", second));
  EXPECT_TRUE(tree.settled("map", "camera", second * 9 / 10));
  EXPECT_TRUE(tree.settled("odom", "camera", second));  // what moves above does not matter
  EXPECT_FALSE(tree.settled("odom", "camera", second + 1));
  add(tree, {{"map", "odom", false, 1.1, 1}, {"map", "other", false, 0.5, 1}});
  EXPECT_TRUE(tree.settled("map", "camera", second));
  EXPECT_FALSE(tree.settled("other", "camera", second));  // up to the map, and down again
  EXPECT_TRUE(tree.settled("other", "camera", second / 2));
}

TEST(TransformTree, ForgetsWhatIsOldOfEachMovingFrame) {
  io::TransformTree tree;
  for (const double t : {1.0, 2.0, 3.0}) tree.add({"map", "base", false}, sample(t, t));
  add(tree, {{"map", "slow", false, 1, 1}, {"base", "camera", true, 0, 0}});
  tree.keep_last(second);
  EXPECT_THAT(why_not(tree, "map", "camera", 1), says("the first is 1.000 s later"));
  EXPECT_EQ(tree.lookup("map", "camera", 2 * second, 0).translation().x(), 2);
  EXPECT_EQ(tree.lookup("map", "slow", second, 0).translation().x(), 1);
}

TEST(TransformTree, ABadFixedTransformReplacesNoGoodOne) {
  io::TransformTree tree;
  add(tree,
      {{"base", "lidar", true, 1, 2}, {"base", "lidar", true, 2, std::numeric_limits<double>::infinity()}});
  EXPECT_EQ(tree.lookup("base", "lidar", second, 0).translation().x(), 2);
}

TEST(TransformTree, GoesUpAndAcross) {
  io::TransformTree tree;
  add(tree, {{"map", "odom", false, 1, 10},
             {"odom", "base", false, 1, 1},
             {"base", "left", true, 0, 0.1},
             {"base", "right", true, 0, -0.1}});
  EXPECT_NEAR(tree.lookup("map", "left", second, 0).translation().x(), 11.1, 1e-12);
  EXPECT_NEAR(tree.lookup("right", "left", second, 0).translation().x(), 0.2, 1e-12);
  EXPECT_NEAR(tree.lookup("left", "map", second, 0).translation().x(), -11.1, 1e-12);
  EXPECT_THAT(tree.ancestors("left"), ElementsAre("left", "base", "odom", "map"));
  EXPECT_TRUE(tree.moves("left"));
  EXPECT_TRUE(tree.moves_below("odom"));
  EXPECT_FALSE(tree.moves_below("base"));
  // Fixed to one another, whatever is known of where both are.
  EXPECT_NEAR(tree.lookup("right", "left", 99 * second, 0).translation().x(), 0.2, 1e-12);
  EXPECT_THAT(why_not(tree, "map", "left", 99), says("no pose of frame base at its time: the last is 98"));
}

TEST(TransformTree, TellsWhatIsMissing) {
  io::TransformTree tree;
  add(tree, {{"map", "base", false, 1, 10}, {"world", "camera", true, 0, 1}});
  EXPECT_THAT(why_not(tree, "map", "lidar", 1), says("no frame 'lidar'"));
  EXPECT_THAT(why_not(tree, "earth", "base", 1), says("no frame 'earth'"));
  EXPECT_THAT(why_not(tree, "map", "camera", 1), says("does not connect camera with map"));
}

TEST(TransformTree, RingsEnd) {
  io::TransformTree tree;
  add(tree, {{"a", "b", true, 0, 1}, {"b", "a", true, 0, 1}, {"c", "d", true, 0, 1}});
  EXPECT_THAT(why_not(tree, "c", "a", 1), says("does not connect"));
  EXPECT_FALSE(tree.moves("a"));
  EXPECT_LE(tree.ancestors("a").size(), 4U);
}

TEST(TransformTree, AFrameInItselfOrWithoutANameIsPassedOver) {
  io::TransformTree tree;
  add(tree, {{"map", "base", false, 1, 2},
             {"base", "base", false, 1, 7},
             {"base", "lidar", true, 0, 1},
             {"lidar", "lidar", true, 0, 7},
             {"base", "", false, 1, 7},
             {"", "", true, 1, 7}});
  EXPECT_EQ(tree.size(), 3U);
  EXPECT_EQ(tree.lookup("map", "lidar", second, 0).translation().x(), 3);
}

TEST(TransformTree, AFixedTransformHoldsFromItsTimeOn) {
  io::TransformTree tree;
  add(tree, {{"base", "lidar", true, 5, 2}, {"base", "lidar", true, 3, 1}, {"base", "camera", true, 3, 1}});
  for (const auto& [stamp_s, x] : {std::pair(0.0, 1), {3.0, 1}, {4.9, 1}, {5.0, 2}, {99.0, 2}})
    EXPECT_EQ(tree.lookup("base", "lidar", std::llround(stamp_s * 1e9), 0).translation().x(), x) << stamp_s;
  EXPECT_EQ(tree.doubts_of("lidar").changed, "lidar in base");
  EXPECT_EQ(tree.doubts_of("camera").changed, "");
}

TEST(TransformTree, WhatNeverChangesHoldsAlwaysIfSomethingElseMoves) {
  io::TransformTree stands, moves;
  for (io::TransformTree* tree : {&stands, &moves})
    for (const double t : {1.0, 2.0, 3.0}) {
      tree->add({"base", "lidar", false}, sample(t, 5));
      tree->add({"map", "base", false}, sample(10 * t, tree == &moves ? t : 1));
    }
  for (io::TransformTree* tree : {&stands, &moves}) tree->finish();
  EXPECT_EQ(moves.lookup("map", "lidar", 20 * second, 0).translation().x(), 7);
  EXPECT_EQ(moves.lookup("base", "lidar", 99 * second, 0).translation().x(), 5);
  EXPECT_THAT(why_not(moves, "map", "lidar", 31), says("no pose of frame base"));
  // All stands: that the last transform is old may be a loss.
  EXPECT_THAT(why_not(stands, "map", "lidar", 20), says("no pose of frame lidar"));
  EXPECT_EQ(stands.lookup("map", "base", 15 * second, 0).translation().x(), 1) << "as before and after";
  stands.hold_steady();
  EXPECT_EQ(stands.lookup("map", "lidar", 99 * second, 0).translation().x(), 6);
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
    io::Trajectory::Sample one = sample(1, 0);
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
