#include "io/readers/trajectory.hpp"

#include "io/readers/scan_files.hpp"

namespace octosurf::test {
namespace {

using io::Trajectory;

constexpr std::int64_t one_second = 1000000000;

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
  EXPECT_EQ(trajectory.at(one_second, 0).translation().x(), 2);
  const auto middle = trajectory.at(one_second * 11 / 10, one_second / 4);
  EXPECT_NEAR(middle.translation().x(), 3, 1e-12);
  EXPECT_NEAR(std::atan2(middle(1, 0), middle(0, 0)), 1.0, 1e-9);
  const Trajectory twice = of_samples({sample_at(1, 2), sample_at(1, 5)});
  EXPECT_EQ(twice.at(one_second, 0).translation().x(), 5) << "the last one holds";
}

TEST(Trajectory, DoesNotGuessOverGaps) {
  const Trajectory trajectory = of_samples({sample_at(1, 2), sample_at(1.3, 4)});
  EXPECT_THROW(trajectory.at(one_second * 12 / 10, one_second / 4), io::NoPose);
  EXPECT_EQ(trajectory.gap_at(one_second * 12 / 10, one_second / 4),
            "its neighbours in time are 0.300 s apart");
  EXPECT_TRUE(trajectory.covers(one_second * 12 / 10, one_second / 2));
  for (const auto& [ms, x] : {std::pair(990, 2), {1010, 2}, {1290, 4}, {1315, 4}})  // the nearest
    EXPECT_EQ(trajectory.at(one_second / 1000 * ms, one_second / 4).translation().x(), x) << ms;
  EXPECT_FALSE(trajectory.covers(one_second * 99 / 100, one_second / 1000));
  EXPECT_EQ(trajectory.gap_at(one_second * 9 / 10, one_second / 4), "the first is 0.100 s later");
  EXPECT_EQ(trajectory.gap_at(one_second * 2, one_second * 10), "the last is 0.700 s earlier");
  EXPECT_EQ(Trajectory().gap_at(0, one_second), "there is none");
  Trajectory::Sample early = sample_at(0, 1), late = sample_at(0, 2);  // their distance is no int64
  early.stamp_ns = std::numeric_limits<std::int64_t>::min();
  late.stamp_ns = std::numeric_limits<std::int64_t>::max();
  EXPECT_THROW(of_samples({early, late}).at(0, one_second), io::NoPose);
}

TEST(Trajectory, AGapOfExactlyTheLargestIsNone) {
  const double since_1970_s = 1305031102.1;  // as double to 0.24 µs
  std::vector<Trajectory::Sample> samples;
  for (int i = 0; i < 100; ++i) samples.push_back(sample_at(since_1970_s + 0.1 * i, i));
  for (int i = 0; i < 99; ++i)
    EXPECT_TRUE(of_samples(samples).covers(io::to_ns(since_1970_s + 0.1 * i + 0.05), one_second / 10)) << i;
}

TEST(Trajectory, LeavesOutWhatIsNoPose) {
  const double nan_m = std::numeric_limits<double>::quiet_NaN();
  for (const double length : {1.014, 0.986, 0.0, nan_m}) {
    Trajectory::Sample bad = sample_at(1.1, 70);
    bad.rotation.coeffs() *= length;
    const Trajectory trajectory = of_samples({sample_at(1, 2), bad, sample_at(1.2, 4)});
    EXPECT_EQ(trajectory.left_out(), 1U) << length;
    EXPECT_NEAR(trajectory.at(one_second * 11 / 10, one_second / 4).translation().x(), 3, 1e-12) << length;
    EXPECT_THROW(of_samples({bad}).at(one_second * 11 / 10, 0), std::runtime_error) << length;
  }
  Trajectory::Sample rounded = sample_at(1.2, 5);
  rounded.rotation.coeffs() *= 0.9996;
  const Trajectory trajectory =
      of_samples({sample_at(1.1, 3), sample_at(1.1, nan_m), rounded});  // two at one time
  EXPECT_EQ(trajectory.left_out(), 1U);
  EXPECT_EQ(trajectory.at(one_second * 11 / 10, one_second / 4).translation().x(), 3);
  EXPECT_EQ(trajectory.at(one_second * 12 / 10, one_second / 4).translation().x(), 5);
}

}  // namespace
}  // namespace octosurf::test
