#include "io/readers/trajectory.hpp"

#include "io/readers/scan_files.hpp"

namespace octosurf::test {
namespace {

using io::Trajectory;
using ::testing::IsEmpty;

constexpr std::int64_t one_second = 1000000000;

Trajectory::Sample sample_at(double stamp_s, double x, double yaw_rad = 0) {
  return {io::to_ns(stamp_s), {x, 0, 0}, {std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)}};
}

Trajectory of_samples(const std::vector<Trajectory::Sample>& samples) {
  Trajectory trajectory;
  for (const Trajectory::Sample& one : samples) trajectory.add(one);
  trajectory.finish();
  trajectory.find_jumps();
  return trajectory;
}

TEST(Trajectory, IsExactAtItsSamplesAndSlerpsBetween) {
  const Trajectory trajectory = of_samples({sample_at(1.2, 4, 1.5), sample_at(1, 2, 0.5)});
  EXPECT_EQ(trajectory.at(one_second, 0).translation().x(), 2);
  const auto middle = trajectory.at(one_second * 11 / 10, one_second / 4);
  EXPECT_NEAR(middle.translation().x(), 3, 1e-12);
  EXPECT_NEAR(std::atan2(middle(1, 0), middle(0, 0)), 1.0, 1e-9);
  EXPECT_EQ(trajectory.step_at(one_second * 11 / 10, one_second / 4), one_second / 5);
  EXPECT_FALSE(trajectory.step_at(one_second, one_second / 4));
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

/// `speed(t)` m/s and `turn(t)` rad/s from 0 to 8 s, `step_s` apart.
template <class Speed, class Turn>
std::vector<Trajectory::Sample> walk(double step_s, const Speed& speed, const Turn& turn) {
  std::vector<Trajectory::Sample> samples;
  double x = 0, yaw = 0;
  for (double t = 0; t < 8; t += step_s) {
    samples.push_back(sample_at(t, x, yaw));
    x += step_s * speed(t);
    yaw += step_s * turn(t);
  }
  return samples;
}
double slowly(double) { return 0.4; }
double never(double) { return 0; }

TEST(Trajectory, AnOdometryThatBeginsAnewIsNotInterpolatedOver) {
  std::vector<Trajectory::Sample> samples = walk(0.02, slowly, slowly);
  const double x = samples[200].translation.x();
  for (std::size_t i = 200; i < samples.size(); ++i) {
    const double t = 0.02 * static_cast<double>(i);
    samples[i] = sample_at(t, 0.4 * (t - 4), 0.4 * (t - 4));
  }
  const Trajectory trajectory = of_samples(samples);
  ASSERT_EQ(trajectory.jumps().size(), 1U);
  EXPECT_NEAR(trajectory.jumps()[0].distance_m, x, 0.02);
  EXPECT_NEAR(trajectory.jumps()[0].angle_rad, x, 0.02);
  EXPECT_EQ(trajectory.gap_at(io::to_ns(3.99), one_second), "they jump there") << "though samples are near";
  EXPECT_EQ(trajectory.at(io::to_ns(4), one_second).translation().x(), 0);
  EXPECT_TRUE(trajectory.covers(io::to_ns(3.97), one_second) &&
              trajectory.covers(io::to_ns(4.01), one_second));
  EXPECT_THAT(io::text_of_jumps(trajectory), says("poses jump by 1.59 m and 91.2 degrees 4.00 s after"));
  EXPECT_EQ(trajectory.around(io::to_ns(4), one_second, 3).size(), 3U) << "none of before";
  EXPECT_EQ(trajectory.around(io::to_ns(5), one_second, 3).size(), 6U);
}

TEST(Trajectory, ACorrectionOfWhatStandsStillIsAJump) {
  std::vector<Trajectory::Sample> samples;
  for (int i = 0; i < 250; ++i) samples.push_back(sample_at(0.02 * i, i > 125 ? 3 : 0, i > 125 ? 0.7 : 0));
  EXPECT_EQ(of_samples(samples).jumps().size(), 1U);
  for (auto& one : samples) one.translation.x() /= 100, one.rotation.setIdentity();
  EXPECT_THAT(of_samples(samples).jumps(), IsEmpty()) << "3 cm";
}

TEST(Trajectory, ABadSampleJumpsThereAndBack) {
  std::vector<Trajectory::Sample> samples = walk(0.1, slowly, never);
  samples[30].translation.x() += 2;
  EXPECT_EQ(of_samples(samples).jumps().size(), 2U);
}

TEST(Trajectory, RightRecordingsDoNotJump) {
  auto random = rng();
  std::normal_distribution<double> noise(0, 0.005);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto stands_then_runs = [](double t) { return t < 6 ? 0.0 : 3.0; };
  const auto turns_on_the_spot = [](double t) { return std::fmod(t, 3) > 2.5 ? 2.5 : 0.0; };
  const auto in_bursts = [](double t) { return std::fmod(t, 1) > 0.8 ? 1.5 : 0.01; };
  for (const double step_s : {0.002, 0.02, 0.1, 0.5}) {
    EXPECT_THAT(of_samples(walk(step_s, stands_then_runs, turns_on_the_spot)).jumps(), IsEmpty()) << step_s;
    EXPECT_THAT(of_samples(walk(step_s, in_bursts, in_bursts)).jumps(), IsEmpty()) << step_s;
    EXPECT_THAT(of_samples(walk(
                               step_s, [](double) { return 30; }, never))
                    .jumps(),
                IsEmpty())
        << step_s;
    auto samples = walk(step_s, slowly, slowly);
    for (auto& one : samples) {  // noise, and messages that come late
      one.translation.x() += noise(random);
      one.stamp_ns += io::to_ns(0.9 * step_s * uniform(random));
    }
    EXPECT_THAT(of_samples(samples).jumps(), IsEmpty()) << step_s;
    std::erase_if(samples, [&](const auto&) { return uniform(random) < 0.7; });
    EXPECT_THAT(of_samples(samples).jumps(), IsEmpty()) << step_s << ", most are lost";
  }
}

}  // namespace
}  // namespace octosurf::test
