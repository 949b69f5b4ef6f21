#include "alignment/pose_fit.hpp"
#include "alignment/surfaces_by_hand.hpp"
#include "support/degree.hpp"

namespace octosurf::test {
namespace {

using test::degree;
const Camera wide{.width = 240, .height = 180, .focal = 150, .noise = 0.004};

TEST(Localizer, FindsScansFromGuessesFarOff) {
  auto rng = test::rng();
  const Scene room = furnished_room();
  const auto map = map_of_rectangles(room, middle_of_room);
  Localizer localizer(map);
  std::uniform_real_distribution<double> share(0.3, 1);
  int found = 0;
  constexpr int scans = 30;
  for (int i = 0; i < scans; ++i) {
    const Eigen::Isometry3d truth = look_at({0.8 + 0.06 * i, 1.0, 1.5}, {2.0, 4.2, 0.7});
    Scan scan = camera_scan(room, truth, rng, wide);
    scan.T_map_sensor =
        octosurf::alignment::moved(truth, any_twist(rng, 0.3 * share(rng), 5 * degree * share(rng)));
    const Alignment alignment = localizer(scan);
    const Twist error = alignment::twist_between(truth, alignment.T_map_sensor);
    const bool right = error.tail<3>().norm() < 0.005 && error.head<3>().norm() < 0.1 * degree;
    found += right;
    EXPECT_TRUE(right || alignment.outcome == AlignmentOutcome::unexplained)
        << i << ": " << error.transpose() << ", said to be found";
  }
  EXPECT_GE(found, scans - 1);
}

TEST(Localizer, SaysSoWhereOtherPosesFitAsWell) {
  auto rng = test::rng();
  // Low walls every 20 cm, each like the next: the scan fits 20 cm further on as well.
  Scene ribs;
  ribs.rectangle({0, 0, 0}, {8, 0, 0}, {0, 4, 0});
  ribs.rectangle({0, 0, 0}, {8, 0, 0}, {0, 0, 2});
  for (int i = 0; i < 40; ++i) ribs.rectangle({0.2 * i, 0.5, 0.6}, {0, 3, 0}, {0, 0, 0.3});
  const auto map = map_of_rectangles(ribs, {0, 1, 3});
  const Eigen::Isometry3d truth = look_at({4, 2, 2.2}, {4.4, 1.9, 0.5});
  Scan scan = camera_scan(ribs, truth, rng, wide);
  Twist off = Twist::Zero();
  off[3] = 0.1;  // half-way between two ribs
  scan.T_map_sensor = octosurf::alignment::moved(truth, off);
  const Alignment alignment = Localizer(map)(scan);
  EXPECT_NE(alignment.outcome, AlignmentOutcome::corrected);
  EXPECT_EQ(alignment.T_map_sensor.matrix(), scan.T_map_sensor.matrix());
}

TEST(Localizer, LeavesWhatNothingFixes) {
  auto rng = test::rng();
  Scene corridor;
  corridor.rectangle({-30, -1, 0}, {60, 0, 0}, {0, 2, 0});
  corridor.rectangle({-30, -1, 0}, {60, 0, 0}, {0, 0, 2.4}).rectangle({-30, 1, 0}, {60, 0, 0}, {0, 0, 2.4});
  const auto map = map_of_rectangles(corridor, {0, 0, 1});
  const Eigen::Isometry3d truth = look_at({0, 0, 1.2}, {2, 0.1, 0.6});
  Scan scan = camera_scan(corridor, truth, rng, wide);
  Twist off = Twist::Zero();
  off.tail<3>() << 0.25, 0.12, -0.08;
  scan.T_map_sensor = octosurf::alignment::moved(truth, off);
  const Alignment alignment = Localizer(map)(scan);
  ASSERT_EQ(alignment.outcome, AlignmentOutcome::corrected);
  EXPECT_EQ(alignment.determined, 5);
  const Twist left = alignment::twist_between(truth, alignment.T_map_sensor);
  EXPECT_NEAR(left[3], off[3], 0.003) << "along the corridor";
  EXPECT_NEAR(left[4], 0, 0.003);
  EXPECT_NEAR(left[5], 0, 0.003);
  EXPECT_GT(std::sqrt(alignment.covariance(3, 3)), 0.1) << "and said to be so unsure";
}

TEST(Localizer, KnowsWhenItKnowsNothing) {
  auto rng = test::rng();
  const auto empty = std::make_shared<const Snapshot>(Snapshot{0, 0.02, {}});
  Scan scan = camera_scan(furnished_room(), look_at({1, 1, 1.5}, {2, 4, 0.7}), rng);
  EXPECT_EQ(Localizer(empty)(scan).outcome, AlignmentOutcome::nothing_known);
  scan.points.clear();
  EXPECT_EQ(Localizer(map_of_rectangles(furnished_room(), middle_of_room))(scan).outcome,
            AlignmentOutcome::nothing_known);
  EXPECT_EQ(Localizer(empty)(scan).samples, 0U);
}

TEST(Localizer, RefusesWhatMakesNoSense) {
  const auto map = map_of_rectangles(furnished_room(), middle_of_room);
  EXPECT_THROW(Localizer(std::shared_ptr<const Snapshot>()), Error);
  EXPECT_THROW(Localizer(map, {.translation_m = -1}), Error);
  EXPECT_THROW(Localizer(map, {.translation_m = 0.3, .rotation_rad = std::nan("")}), Error);
  EXPECT_THROW(Localizer(map, {.translation_m = 0.3, .rotation_rad = 3.2}), Error);
  Scan scan;
  scan.T_map_sensor.linear() *= 2;
  EXPECT_THROW(Localizer{map}(scan), Error);
}

}  // namespace
}  // namespace octosurf::test
