// Messages of every layout and such as no driver sends, and what is made of their poses and times.
#include "io/files.hpp"
#include "io/readers/bag_files.hpp"
#include "io/readers/scan_motion.hpp"
#include "io/readers/sensor_messages.hpp"
#include "io/readers/trajectory.hpp"
#include "io/readers/transform_tree.hpp"

namespace octosurf::test {
namespace {

constexpr std::uint64_t plenty = std::uint64_t{64} << 20;

/// The message of the exception that reading throws.
template <class Read>
std::string refusal(const std::string& bytes, MessageEncoding encoding, const Read& read) {
  try {
    read(*io::message_reader(bytes, encoding));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "not refused";
}

std::string cloud_refusal(const std::string& bytes, std::uint64_t limit = plenty) {
  return refusal(bytes, MessageEncoding::cdr,
                 [&](io::MessageReader& message) { io::read_cloud_message(message, limit); });
}

CdrBytes cloud_of(std::uint32_t height, std::uint32_t width, std::uint32_t step, std::uint32_t row_step,
                  std::size_t bytes, const std::string& names = "xyz", std::uint8_t type = 7) {
  CdrBytes message;
  message.header(1, "lidar").u32(height).u32(width).u32(static_cast<std::uint32_t>(names.size()));
  for (std::uint32_t i = 0; i < names.size(); ++i)
    message.text(names.substr(i, 1)).u32(4 * i).u8(type).u32(1);
  return message.u8(0).u32(step).u32(row_step).bytes(std::string(bytes, '\0')).u8(1);
}

TEST(Messages, OfEveryLengthAreReadOrRefused) {
  const std::string point = cloud(1).bytes, moved = tf(1, "map", "lidar", 3).bytes;
  const auto short_or_foreign = AnyOf(says("ends too early"), says("not CDR"));
  const auto read_tf = [](io::MessageReader& message) {
    io::for_each_transform(message, [](const io::TransformMessage&) {});
  };
  for (std::size_t n = 0; n < point.size() - 1; ++n)  // whether it is dense is not asked
    EXPECT_THAT(cloud_refusal(point.substr(0, n)), short_or_foreign) << n;
  for (std::size_t n = 0; n < moved.size(); ++n)
    EXPECT_THAT(refusal(moved.substr(0, n), MessageEncoding::cdr, read_tf), short_or_foreign) << n;
  for (std::size_t n = 0; n < moved.size() - 4; ++n)
    EXPECT_THAT(refusal(moved.substr(4, n), MessageEncoding::ros1, read_tf), says("ends too early")) << n;
}

TEST(Messages, OfSizesThatTheyDoNotHaveAreRefused) {
  constexpr std::uint32_t huge = 4000000000;
  for (const auto& [message, words] : std::vector<std::pair<CdrBytes, const char*>>{
           {cloud_of(1, huge, 12, 12, 12), "says it has 4000000000x1 points"},
           {cloud_of(huge, huge, 12, 12, 24), "says it has"},
           {cloud_of(huge, 1, 12, 12, 24), "says it has"},
           {cloud_of(2, 1, 12, 11, 24), "says it has"},
           {cloud_of(2, 1, 12, 0, 24), "says it has"},
           {cloud_of(1, 1, 11, 12, 24), "lies outside"},
           {cloud_of(1, huge, 0, 0, 0), "lies outside"},
           {cloud_of(1, 1, 12, 12, 12, "xyy"), "one each of x, y and z"},
           {cloud_of(1, 1, 12, 12, 12, "xyz", 5), "no float32 or float64"}})
    EXPECT_THAT(cloud_refusal(message.all()), says(words));
  EXPECT_THAT(cloud_refusal(cloud_of(1, 1000, 12, 12000, 12000).all(), 11999),
              says("far more than its bag's size"));
  EXPECT_TRUE(io::read_cloud_message(
                  *io::message_reader(cloud_of(1, 0, 12, 0, 0).all(), MessageEncoding::cdr), plenty)
                  .points.empty());
}

TEST(Messages, ImagesOfSizesThatTheyDoNotHaveAreRefused) {
  struct Image {
    std::uint32_t height, width;
    const char* encoding;
    std::uint32_t step;
    std::size_t bytes;
    const char* words;
  };
  for (const auto& [height, width, encoding, step, bytes, words] :
       {Image{4, 6, "16UC1", 12, 47, "says it has 6x4 pixels"}, Image{4, 6, "16UC1", 11, 48, "says it has"},
        Image{4, 6, "16UC1", 0, 48, "says it has"}, Image{4, 6, "32FC1", 12, 48, "says it has"},
        Image{4, 6, "rgb8", 18, 72, "no depth image"}, Image{0, 6, "16UC1", 12, 48, "image of 6x0"},
        Image{8000, 8000, "16UC1", 16000, 48, "says it has"},
        Image{4000000000, 4000000000, "16UC1", 4, 48, "image of"}}) {
    CdrBytes image;
    image.header(1, "camera").u32(height).u32(width).text(encoding).u8(0).u32(step);
    image.bytes(std::string(bytes, '\0'));
    const auto read = [](io::MessageReader& message) {
      io::points_of(io::read_image_message(message), {1, 1, 0, 0}, nullptr, {}, plenty);
    };
    EXPECT_THAT(refusal(image.all(), MessageEncoding::cdr, read), says(words));
  }
}

using io::Trajectory;

constexpr std::int64_t second = 1000000000;

Trajectory::Sample sample_at(double stamp_s, double x, double yaw_rad = 0) {
  return {io::to_ns(stamp_s), {x, 0, 0}, {std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)}};
}

Trajectory of_samples(const std::vector<Trajectory::Sample>& samples) {
  Trajectory trajectory;
  for (const Trajectory::Sample& one : samples) trajectory.add(one);
  trajectory.finish();
  return trajectory;
}

TEST(Trajectory, IsExactAtItsSamplesAndSlerpsBetween) {
  const Trajectory trajectory = of_samples({sample_at(1.2, 4, 1.5), sample_at(1, 2, 0.5)});
  EXPECT_EQ(trajectory.at(second, 0).translation().x(), 2);
  const auto middle = trajectory.at(second * 11 / 10, second / 4);
  EXPECT_NEAR(middle.translation().x(), 3, 1e-12);
  EXPECT_NEAR(std::atan2(middle(1, 0), middle(0, 0)), 1.0, 1e-9);
  const Trajectory twice = of_samples({sample_at(1, 2), sample_at(1, 5)});
  EXPECT_EQ(twice.at(second, 0).translation().x(), 5) << "the last one holds";
}

TEST(Trajectory, DoesNotGuessOverGaps) {
  const Trajectory trajectory = of_samples({sample_at(1, 2), sample_at(1.3, 4)});
  EXPECT_THROW(trajectory.at(second * 12 / 10, second / 4), io::NoPose);
  EXPECT_EQ(trajectory.gap_at(second * 12 / 10, second / 4), "its neighbours in time are 0.300 s apart");
  EXPECT_EQ(trajectory.gap_at(second * 12 / 10, second / 2), "");
  for (const auto& [ms, x] : {std::pair(990, 2), {1010, 2}, {1290, 4}, {1315, 4}})  // the nearest
    EXPECT_EQ(trajectory.at(second / 1000 * ms, second / 4).translation().x(), x) << ms;
  EXPECT_NE(trajectory.gap_at(second * 99 / 100, second / 1000), "");
  EXPECT_EQ(trajectory.gap_at(second * 9 / 10, second / 4), "the first is 0.100 s later");
  EXPECT_EQ(trajectory.gap_at(second * 2, second * 10), "the last is 0.700 s earlier");
  EXPECT_EQ(Trajectory().gap_at(0, second), "there is none");
  Trajectory::Sample early = sample_at(0, 1), late = sample_at(0, 2);  // their distance is no int64
  early.stamp_ns = std::numeric_limits<std::int64_t>::min();
  late.stamp_ns = std::numeric_limits<std::int64_t>::max();
  EXPECT_THROW(of_samples({early, late}).at(0, second), io::NoPose);
}

TEST(Trajectory, AGapOfExactlyTheLargestIsNone) {
  const double since_1970_s = 1305031102.1;  // as double to 0.24 µs
  std::vector<Trajectory::Sample> samples;
  for (int i = 0; i < 100; ++i) samples.push_back(sample_at(since_1970_s + 0.1 * i, i));
  for (int i = 0; i < 99; ++i)
    EXPECT_EQ(of_samples(samples).gap_at(io::to_ns(since_1970_s + 0.1 * i + 0.05), second / 10), "") << i;
}

TEST(Trajectory, LeavesOutWhatIsNoPose) {
  const double nan_m = std::numeric_limits<double>::quiet_NaN();
  for (const double length : {1.014, 0.986, 0.0, nan_m}) {
    Trajectory::Sample bad = sample_at(1.1, 70);
    bad.rotation.coeffs() *= length;
    const Trajectory trajectory = of_samples({sample_at(1, 2), bad, sample_at(1.2, 4)});
    EXPECT_EQ(trajectory.left_out(), 1U) << length;
    EXPECT_NEAR(trajectory.at(second * 11 / 10, second / 4).translation().x(), 3, 1e-12) << length;
    EXPECT_THROW(of_samples({bad}).at(second * 11 / 10, 0), std::runtime_error) << length;
  }
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
    tree.add({edge.parent, edge.child, edge.fixed}, sample_at(edge.stamp_s, edge.x));
  tree.finish();
}

TEST(TransformTree, IsSettledWhenNothingThatComesLaterCanChangeAnAnswer) {
  io::TransformTree tree;
  EXPECT_GE(tree.newest("map", "map"), second);
  EXPECT_LT(tree.newest("map", "camera"), second);
  add(tree, {{"base", "camera", true, 0, 1}, {"odom", "base", false, 1, 1}});
  EXPECT_LT(tree.newest("map", "camera"), second);  // does not hang together yet
  add(tree, {{"map", "odom", false, 0.9, 1}});
  EXPECT_LT(tree.newest("map", "camera"), second);
  EXPECT_GE(tree.newest("map", "camera"), second * 9 / 10);
  EXPECT_GE(tree.newest("odom", "camera"), second);  // what moves above does not matter
  EXPECT_LT(tree.newest("odom", "camera"), second + 1);
  add(tree, {{"map", "odom", false, 1.1, 1}, {"map", "other", false, 0.5, 1}});
  EXPECT_GE(tree.newest("map", "camera"), second);
  EXPECT_LT(tree.newest("other", "camera"), second);  // up to the map, and down again
  EXPECT_GE(tree.newest("other", "camera"), second / 2);
}

TEST(TransformTree, ForgetsWhatIsOldOfEachMovingFrame) {
  io::TransformTree tree;
  for (const double t : {1.0, 2.0, 3.0}) tree.add({"map", "base", false}, sample_at(t, t));
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
  EXPECT_NEAR(tree.lookup("right", "left", second, 0).translation().x(), 0.2, 1e-12);
  EXPECT_THAT(tree.ancestors("left"), ElementsAre("left", "base", "odom", "map"));
  EXPECT_TRUE(tree.moves("left"));
  EXPECT_TRUE(tree.moves_below("odom"));
  EXPECT_FALSE(tree.moves_below("base"));
  // Fixed to one another, whatever is known of where both are.
  EXPECT_NEAR(tree.lookup("right", "left", 99 * second, 0).translation().x(), 0.2, 1e-12);
  EXPECT_THAT(why_not(tree, "map", "left", 99), says("no pose of frame base at its time: the last is 98"));
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
      tree->add({"base", "lidar", false}, sample_at(t, 5));
      tree->add({"map", "base", false}, sample_at(10 * t, tree == &moves ? t : 1));
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
    io::Trajectory::Sample one = sample_at(1, 0);
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

using Zero = io::PointClock::Zero;

constexpr double first_stamp_s = 1700000000.5;

/// Three clouds at 10 Hz; times from `first_s` to `last_s` after the stamp, as `value(stamp, after)` has
/// them.
template <class Value>
std::vector<io::TimedCloud> timed_clouds(double first_s, double last_s, const Value& value) {
  std::vector<io::TimedCloud> all;
  for (int i = 0; i < 3; ++i) {
    const double stamp = first_stamp_s + 0.1 * i;
    all.push_back({stamp, value(stamp, first_s), value(stamp, last_s)});
  }
  return all;
}

TEST(PointClock, UnitsAreToldBySpan) {
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    const auto expect_clock = [&](Zero zero, double first_s, const auto& value) {
      const auto clock = io::clock_of(timed_clouds(first_s, first_s + 0.0999, value), 0.1);
      ASSERT_TRUE(clock) << unit_s;
      EXPECT_EQ(clock->unit_s, unit_s);
      EXPECT_EQ(clock->zero, zero);
    };
    for (const double first_s : {0.0, -0.0999, -0.05}) {
      expect_clock(Zero::stamp, first_s, [&](double, double s) { return s / unit_s; });
      expect_clock(Zero::epoch, first_s, [&](double stamp, double s) { return (stamp + s) / unit_s; });
    }
    // Seconds since the sensor was switched on.
    expect_clock(Zero::other_clock, 0,
                 [&](double stamp, double s) { return (stamp - first_stamp_s + 777 + s) / unit_s; });
  }
}

TEST(PointClock, AnyPeriodOfScans) {
  for (const double period_s : {0.02, 0.05, 1.0, 5.0, 100.0})  // from 50 Hz to every thousandth scan recorded
    for (const double unit_s : {1.0, 1e-9}) {
      const double span_s = std::min(period_s, 0.1);
      const auto clock =
          io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 0, span_s / unit_s}}, period_s);
      ASSERT_TRUE(clock);
      EXPECT_EQ(clock->unit_s, unit_s) << period_s;
    }
}

TEST(PointClock, WhatIsAllAtOnceOrFitsNoUnitIsNoTime) {
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 0, 0}}, 0.1));
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 5, 5}}, 0.1));
  EXPECT_FALSE(io::clock_of(std::vector<io::TimedCloud>{{first_stamp_s, 0, 1e12}}, 0.1));
  EXPECT_FALSE(io::clock_of({}, 0.1));
}

TEST(PointClock, OnlyReadingsCount) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector3f> points{{1, 0, 0}, {nan, nan, nan}, {2, 0, 0}, {3, 0, 0}};
  const io::PointTimes times{"timestamp", {first_stamp_s + 0.01, 0, first_stamp_s + 0.09, std::nan("")}};
  const auto cloud = io::timed_cloud(first_stamp_s, points, times);
  ASSERT_TRUE(cloud);
  EXPECT_EQ(cloud->first, first_stamp_s + 0.01);
  EXPECT_EQ(cloud->last, first_stamp_s + 0.09);
  const auto clock = io::clock_of(std::vector{*cloud}, 0.1);
  ASSERT_TRUE(clock);
  const auto after = clock->after_stamp(first_stamp_s, points, times);
  EXPECT_NEAR(after[0], 0.01, 1e-6);
  EXPECT_TRUE(std::isnan(after[1]));
  EXPECT_NEAR(after[2], 0.09, 1e-6);
  EXPECT_TRUE(std::isnan(after[3]));
}

}  // namespace
}  // namespace octosurf::test
