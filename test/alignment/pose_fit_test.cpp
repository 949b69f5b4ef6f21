#include "alignment/pose_fit.hpp"

#include "alignment/pose_search.hpp"
#include "alignment/surfaces_by_hand.hpp"

namespace octosurf::test {
namespace {

using test::degree;

/// The room, its map, and a place in it.
class PoseFitInARoom : public ::testing::Test {
 protected:
  Scan scan_of(const Scene& scene, double noise) {
    return camera_scan(scene, truth, rng, {.width = 240, .height = 180, .focal = 150, .noise = noise});
  }
  std::mt19937_64 rng = test::rng();
  const Scene room = furnished_room();
  const std::shared_ptr<const Snapshot> map = map_of_rectangles(room, middle_of_room);
  const Eigen::Isometry3d truth = look_at({1.2, 1.0, 1.4}, {2.2, 4.5, 0.6});
};
using PoseSearchInARoom = PoseFitInARoom;

struct Aligned {
  alignment::PoseFit fit;
  alignment::Determined determined;
};

/// The fine step from `start` for a scan that was taken at its own pose.
Aligned fine(const std::shared_ptr<const Snapshot>& map, const Scan& scan, const Eigen::Isometry3d& start,
             const alignment::FitErrors& errors = {},
             const TwistCovariance& prior = alignment::uncertainty(1 * degree, 0.03)) {
  alignment::NearSurfaces near;
  sensing::NoiseModel noise{Parameters()};
  noise.observe(scan);
  const alignment::PoseSearch search(*map, near, scan, noise, {0, 10}, start, {}, errors);
  Aligned aligned{search.fine(start, prior), {}};
  aligned.determined = alignment::determined_by(aligned.fit, map->resolution);
  return aligned;
}

TEST_F(PoseFitInARoom, FindsASmallDisplacement) {
  for (int i = 0; i < 10; ++i) {
    const Eigen::Isometry3d place = look_at({1.2, 1.0 + 0.1 * i, 1.4}, {2.2, 4.5, 0.6});
    const Scan scan =
        camera_scan(room, place, rng, {.width = 240, .height = 180, .focal = 200, .noise = 0.003});
    const Eigen::Isometry3d start = octosurf::alignment::moved(place, any_twist(rng, 0.02, 0.5 * degree));
    const Aligned aligned = fine(map, scan, start);
    ASSERT_EQ(aligned.determined.count, 6);
    const Twist error = alignment::twist_between(place, aligned.fit.T_map_sensor);
    // 3 mm a reading, 3,000 samples of up to 8: 0.02 mm if nothing were in common; six directions that three
    // walls fix unevenly, and what readings of a surface have in common (FitErrors) leave a millimetre.
    EXPECT_LT(error.tail<3>().norm(), 1.5e-3) << i;
    EXPECT_LT(error.head<3>().norm(), 0.04 * degree) << i;
    EXPECT_GT(aligned.fit.explained_share(), 0.95);
  }
}

/// Moves readings of the wall at the back along their lines of sight: its spots, 10 cm wide, lie up to 8 mm
/// before or behind it.
void make_uneven(Scan& scan, std::mt19937_64& rng) {
  std::map<std::pair<int, int>, float> off;
  std::uniform_real_distribution<float> depth(-0.008f, 0.008f);
  for (Eigen::Vector3f& point : scan.points) {
    const Eigen::Vector3d place = scan.T_map_sensor * point.cast<double>();
    if (!(place.y() > 4.9)) continue;
    const std::pair spot(static_cast<int>(std::floor(place.x() / 0.1)),
                         static_cast<int>(std::floor(place.z() / 0.1)));
    if (!off.contains(spot)) off[spot] = depth(rng);
    point *= 1 + off[spot] / point.norm();
  }
}

/// Mean over 40 scans of a room of the pose's squared error, in the standard deviations that are stated.
double mean_squared_error(int width, int height, double focal, double noise) {
  auto rng = test::rng();
  const Scene room = furnished_room();
  const auto map = map_of_rectangles(room, middle_of_room);
  double squared = 0;
  constexpr int scans = 40;
  for (int i = 0; i < scans; ++i) {
    const double turn = 2 * std::numbers::pi * i / scans;
    const Eigen::Vector3d eye =
        middle_of_room + Eigen::Vector3d(0.6 * std::cos(turn), 0.6 * std::sin(turn), 0.3);
    const Eigen::Isometry3d truth = look_at(eye, {2 + 1.5 * std::cos(turn), 3.2, 0.5});
    const Scan scan =
        camera_scan(room, truth, rng, {.width = width, .height = height, .focal = focal, .noise = noise});
    const Aligned aligned =
        fine(map, scan, octosurf::alignment::moved(truth, any_twist(rng, 0.01, 0.2 * degree)));
    const Twist error = alignment::twist_between(truth, aligned.fit.T_map_sensor);
    squared += error.dot(aligned.fit.information * error);
  }
  return squared / scans;
}

// The map is exact here, and readings have nothing in common, although alignment allows for both: so errors
// are smaller than said, but not by far, since the noise is the larger part. Six dimensions; the mean over
// 40 scans of a chi square of 6 is 6 ± 0.55. The second are as sparse as a laser's line, which has fewer
// readings than the samples could take up: they overlap, and tell no more for it; too far apart to tell their
// noise, they are taken to err by 5 mm, as they do.
TEST(PoseFit, ErrorsAreAsItsCovarianceSays) {
  for (const double squared :
       {mean_squared_error(240, 180, 150, 0.01), mean_squared_error(48, 36, 30, 0.005)}) {
    EXPECT_LT(squared, 6 + 4 * 0.55);
    EXPECT_GT(squared, 0.5);
  }
}

TEST(PoseFit, AnUnevenWallMakesTheOthersNoWorse) {
  auto rng = test::rng();
  Scene corner;
  corner.rectangle({0, 0, 0}, {4, 0, 0}, {0, 5, 0}).rectangle({4, 0, 0}, {0, 5, 0}, {0, 0, 2.5});
  corner.rectangle({0, 5, 0}, {4, 0, 0}, {0, 0, 2.5});
  const auto map = map_of_rectangles(corner, middle_of_room);
  const Eigen::Isometry3d truth = look_at({1.2, 1.0, 1.4}, {2.2, 4.5, 0.6});
  Scan scan = camera_scan(corner, truth, rng, {.width = 240, .height = 180, .focal = 150, .noise = 0.003});
  // Readings have nothing in common here: the wall's own error would hide what its readings say.
  const alignment::FitErrors errors{.common_m = 1e-5};
  const alignment::PoseFit even = fine(map, scan, truth, errors).fit;
  make_uneven(scan, rng);
  const alignment::PoseFit uneven = fine(map, scan, truth, errors).fit;
  // The floor fixes the height as it did; the wall fixes y less, although what the map knows of the wall is
  // the larger part of that.
  EXPECT_GT(uneven.information(5, 5), 0.8 * even.information(5, 5));
  EXPECT_LT(uneven.information(4, 4), 0.88 * even.information(4, 4));
}

TEST_F(PoseFitInARoom, WhereSurfacesDisagreeThePoseIsLessSure) {
  // The same map with its back wall 8 mm nearer, twenty times what a surface is taken to be off: no pose fits
  // it and the cupboard's front at once, and no reading is so far off that it is left out.
  auto bent = std::make_shared<Snapshot>(*map);
  for (SurfacePtr& surface : bent->surfaces) {
    if (surface->plane.normal.y() > -0.9 || surface->plane.offset > -4.9) continue;
    auto nearer = std::make_shared<Surface>(*surface);
    nearer->plane.offset += 0.008;
    nearer->T_map_surface.pretranslate(Eigen::Vector3d(0, -0.008, 0));
    for (Eigen::Vector3d& vertex : nearer->boundary) vertex.y() -= 0.008;
    surface = nearer;
  }
  const Scan scan = scan_of(room, 0.01);
  const TwistCovariance right = fine(map, scan, truth).fit.information;
  const TwistCovariance wrong = fine(bent, scan, truth).fit.information;
  // As sure, within some per cent, if the disagreement did not count.
  EXPECT_LT(wrong.trace(), right.trace() / 1.25);
}

TEST_F(PoseSearchInARoom, SamplesSpeakForThePoseThatExplainsMoreOfThem) {
  const Scan scan = scan_of(room, 0.01);
  alignment::NearSurfaces near;
  sensing::NoiseModel noise{Parameters()};
  noise.observe(scan);
  const alignment::PoseSearch search(*map, near, scan, noise, {0, 10}, truth, {});
  const Eigen::Isometry3d far = octosurf::alignment::moved(truth, any_twist(rng, 0.1, 2 * degree));
  EXPECT_TRUE(search.speak_for(truth, far, 4));
  EXPECT_FALSE(search.speak_for(far, truth, 4));
  // Means of eight readings err by 3.5 mm: a tenth of that is nothing.
  const Eigen::Isometry3d beside = octosurf::alignment::moved(truth, any_twist(rng, 0.0003, 0.002 * degree));
  EXPECT_FALSE(search.speak_for(truth, beside, 4));
  EXPECT_FALSE(search.speak_for(beside, truth, 4));
}

/// A floor and a stair of treads 0.28 m deep and 0.17 m high that goes up along x.
Scene stair_of(int treads) {
  Scene scene;
  scene.rectangle({-2, -1, 0}, {2, 0, 0}, {0, 2, 0});
  for (int i = 0; i < treads; ++i) {
    scene.rectangle({0.28 * i, -1, 0.17 * i}, {0, 2, 0}, {0, 0, 0.17});
    scene.rectangle({0.28 * i, -1, 0.17 * (i + 1)}, {0.28, 0, 0}, {0, 2, 0});
  }
  return scene;
}

TEST(PoseSearch, WhereNothingWasSeenTheMapSpeaksForNoPose) {
  // fixed: a scan of a stair that goes on was laid a tread too low, where its new treads lie on known ones.
  auto rng = test::rng();
  const auto map = map_of_rectangles(stair_of(4), {-1, 0, 1.5});
  const Eigen::Isometry3d truth = look_at({-0.9, 0.1, 1.6}, {1.5, 0, 0.9});
  const Scan scan =
      camera_scan(stair_of(9), truth, rng, {.width = 240, .height = 180, .focal = 150, .noise = 0.01});
  alignment::NearSurfaces near;
  sensing::NoiseModel noise{Parameters()};
  noise.observe(scan);
  const alignment::PoseSearch search(*map, near, scan, noise, {0, 10}, truth, {});
  Twist step;
  step << 0, 0, 0, -0.28, 0, -0.17;
  const Eigen::Isometry3d lower = octosurf::alignment::moved(truth, step);
  EXPECT_GT(search.fitter().lay(lower).explained, search.fitter().lay(truth).explained);
  EXPECT_FALSE(search.speak_for(lower, truth, 4));
}

TEST(PoseFit, ABareFloorLeavesThreeDirections) {
  auto rng = test::rng();
  Scene floor;
  floor.rectangle({-5, -5, 0}, {10, 0, 0}, {0, 10, 0});
  const auto map = map_of_rectangles(floor, {0, 0, 1});
  const Eigen::Isometry3d truth = look_at({0, 0, 1}, {1, 0.3, 0});
  const Scan scan = camera_scan(floor, truth, rng);
  Twist off = Twist::Zero();
  off[2] = 0.3 * degree;  // about the vertical
  off[3] = 0.015;         // along
  off[5] = 0.012;         // up
  const Aligned aligned = fine(map, scan, octosurf::alignment::moved(truth, off));
  EXPECT_EQ(aligned.determined.count, 3);
  const Eigen::Isometry3d pose = alignment::without_undetermined(octosurf::alignment::moved(truth, off),
                                                                 aligned.fit, aligned.determined);
  const Twist left = alignment::twist_between(truth, pose);
  // What a scan's readings are taken to have in common, 0.3 mm and 0.3 mrad at 2.5 m, three times.
  EXPECT_NEAR(left[5], 0, 2.5e-3);
  EXPECT_NEAR(left[3], off[3], 1e-3) << "nothing fixes it along the floor";
  EXPECT_NEAR(left[2], off[2], 0.02 * degree);
}

// On a board 15 cm wide, away from its boundaries, lie hardly a dozen samples; and what is there now is the
// face of another board, 2 cm before it. Were it believed, it would take the scan along.
TEST(PoseFit, AFewSamplesFixNoDirection) {
  auto rng = test::rng();
  const auto floor_and_board_at = [](double x, double width) {
    Scene scene;
    scene.rectangle({-5, -5, 0}, {10, 0, 0}, {0, 10, 0})
        .rectangle({x, -width / 2, 0}, {0, width, 0}, {0, 0, 0.2});
    return scene;
  };
  const Eigen::Isometry3d truth = look_at({0, 0, 1}, {1, 0, 0});
  const auto determined = [&](double width) {
    const auto map = map_of_rectangles(floor_and_board_at(1, width), {0, 0, 1});
    const Aligned aligned = fine(map, camera_scan(floor_and_board_at(0.98, width), truth, rng), truth);
    return aligned.determined.count;
  };
  EXPECT_EQ(determined(0.15), 3);
  EXPECT_GT(determined(1), 3) << "of a metre there are enough";
}

TEST_F(PoseFitInARoom, SomebodyWhoWalksByDoesNotDragIt) {
  Scene with_person = room;
  with_person.box({1.6, 2.4, 0}, {2.1, 2.7, 1.8});
  const Scan scan = camera_scan(with_person, truth, rng);
  const Aligned aligned =
      fine(map, scan, octosurf::alignment::moved(truth, any_twist(rng, 0.01, 0.2 * degree)));
  const Twist error = alignment::twist_between(truth, aligned.fit.T_map_sensor);
  EXPECT_LT(error.tail<3>().norm(), 2e-3);
  EXPECT_LT(error.head<3>().norm(), 0.06 * degree);
}

TEST(PoseFit, TwistsAndPosesAreInverse) {
  auto rng = test::rng();
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d from =
        octosurf::alignment::moved(Eigen::Isometry3d::Identity(), any_twist(rng, 5, 3));
    const Twist twist = any_twist(rng, 1, 2);
    EXPECT_LT((alignment::twist_between(from, octosurf::alignment::moved(from, twist)) - twist).norm(), 1e-9);
  }
}

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
