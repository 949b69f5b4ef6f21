#include "alignment/drift_filter.hpp"

#include "alignment/pose_fit.hpp"
#include "alignment/pose_search.hpp"
#include "alignment/revisit.hpp"
#include "alignment/surfaces_by_hand.hpp"

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

using alignment::DriftFilter;
using alignment::Revisit;
using alignment::SensorErrors;

constexpr double resolution = 0.02, lever_m = 2, noise_m = 0.0005;

/// Where a robot is that walks in a circle: a quarter of a metre and 5° from scan to scan.
Eigen::Isometry3d pose_at(int i) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(0.085 * i, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = T.linear() * Eigen::Vector3d(3, 0, 1);
  return T;
}

/// What turns with the sensor: by a tilt about its axes the whole view turns likewise, by a scale it comes
/// nearer along the line of sight (x). The part that the map has from the views before is as of a quarter
/// turn back.
Eigen::Matrix<double, 6, alignment::sensor_error_size> by_error_at(int i) {
  const auto alone = [](int k) {
    Eigen::Matrix<double, 6, alignment::sensor_error_size> by = decltype(by)::Zero();
    const Eigen::Matrix3d R = pose_at(k).linear();
    by.topLeftCorner<3, 3>() = -R;
    by.block<3, 1>(3, 3) = -lever_m * R.col(0);
    return by;
  };
  return alone(i) - alone(i - 18);
}

/// What scan i measures, laid on the map at `laid`, if the map has it at `truth`.
Revisit revisit(int i, const Eigen::Isometry3d& laid, const Eigen::Isometry3d& truth,
                const SensorErrors& errors, std::mt19937_64& rng, int count = 6) {
  std::normal_distribution<double> noise(0, noise_m);
  Revisit r;
  r.lever_m = lever_m;
  r.patches = 100;
  r.scatter_m = alignment::map_error_voxels * resolution;
  Twist per_metre;
  per_metre << Eigen::Vector3d::Constant(lever_m), Eigen::Vector3d::Ones();
  // Translations first, so that fewer directions are those.
  TwistCovariance order = TwistCovariance::Zero();
  for (int k = 0; k < 6; ++k) order(k, (k + 3) % 6) = 1;
  r.directions = (order * TwistCovariance(per_metre.asDiagonal())).topRows(count);
  r.by_error = r.directions * by_error_at(i);
  r.motion = r.directions * alignment::twist_between(laid, truth) + r.by_error * errors;
  for (int k = 0; k < count; ++k) r.motion[k] += noise(rng);
  r.variances.setConstant(count, noise_m * noise_m);
  return r;
}

struct Walk {
  alignment::AlignmentState state;
  std::mt19937_64 rng = test::rng();
  SensorErrors errors = SensorErrors::Zero();
  bool ever_drifted = false;

  /// `truth`: where the map has the scan; `count`: of the directions that are measured, none if 0.
  Eigen::Isometry3d step(int i, const Eigen::Isometry3d& given, const Eigen::Isometry3d& truth,
                         int count = 6) {
    DriftFilter filter(state, SensorKind::depth_camera, resolution, Eigen::Vector3d::UnitZ());
    filter.advance(given);
    const Eigen::Isometry3d laid = filter.pose();
    if (count > 0 && filter.is_new_view()) {
      filter.learn(laid, revisit(i, laid, truth, errors, rng, count));
      state.view_m = state.travelled_m;
    }
    ever_drifted = ever_drifted || filter.drifts();
    return filter.pose();
  }
};

double error_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

/// Slides by 2 mm and turns by 0.03° a scan, about the vertical.
Eigen::Isometry3d slid(int i, const Eigen::Isometry3d& T) {
  return Eigen::Translation3d(0.0015 * i, -0.0013 * i, 0) *
         Eigen::AngleAxisd(0.0005 * i, Eigen::Vector3d::UnitZ()) * T;
}

TEST(DriftFilter, ExactPosesStayBitForBit) {
  Walk walk;
  for (int i = 0; i < 1000; ++i)
    ASSERT_EQ(walk.step(i, pose_at(i), pose_at(i)).matrix(), pose_at(i).matrix()) << i;
}

TEST(DriftFilter, AnErrorOfTheSensorIsNoDriftAndIsFound) {
  Walk walk;
  walk.errors[0] = 0.009;
  walk.errors[1] = -0.006;
  walk.errors[3] = 0.01;
  for (int i = 0; i < 200; ++i)
    ASSERT_EQ(walk.step(i, pose_at(i), pose_at(i)).matrix(), pose_at(i).matrix()) << i;
  const auto& found = walk.state.hypotheses.at(walk.state.believed);
  for (const int k : {0, 1, 3}) {
    const double deviation = std::sqrt(found.covariance(6 + k, 6 + k));
    EXPECT_NEAR(found.errors[k], walk.errors[k], 5 * deviation) << k;
    EXPECT_LT(deviation, 0.2 * std::fabs(walk.errors[k])) << k;
  }
  // Whatever turns about the vertical alone does not tell a tilt about it.
  EXPECT_GT(std::sqrt(found.covariance(8, 8)), 0.015);
}

TEST(DriftFilter, FollowsADriftAlsoBesideAnErrorOfTheSensor) {
  for (const double error : {0.0, 0.009}) {
    Walk walk;
    walk.errors[0] = error;
    walk.errors[3] = -error;
    double given = 0, used = 0;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Isometry3d T = slid(i, pose_at(i)), found = walk.step(i, T, pose_at(i));
      if (i < (error > 0 ? 40 : 20)) continue;
      given += error_m(T, pose_at(i));
      used += error_m(found, pose_at(i));
    }
    EXPECT_LT(used, given / (error > 0 ? 10 : 20));
    EXPECT_NEAR(walk.state.hypotheses.at(walk.state.believed).errors[0], error, 0.2 * 0.009);
  }
}

/// Height, roll and pitch fit every scan, as odometry that knows gravity leaves them; that must not hide that
/// the rest slides (a stair walked up and down, of which only the risers tell it, was mapped twice).
TEST(DriftFilter, ALevelDriftIsNotHiddenByWhatDoesNotDrift) {
  Walk walk;
  for (int i = 0; i < 300; ++i) walk.step(i, pose_at(i), pose_at(i));
  int until = 300;
  for (; until < 400 && !walk.ever_drifted; ++until)
    walk.step(until, slid(until - 300, pose_at(until)), pose_at(until));
  EXPECT_LT(until, 325) << "4 cm";
}

TEST(DriftFilter, WhatTheOctreeWouldNotNoticeStays) {
  Walk walk;
  const Eigen::Translation3d off(0.002, 0.001, 0);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Isometry3d given = off * pose_at(i);
    ASSERT_EQ(walk.step(i, given, pose_at(i)).matrix(), given.matrix()) << i;
  }
}

TEST(DriftFilter, WhereNothingIsSeenAgainTheCorrectionStays) {
  Walk walk;
  for (int i = 0; i < 100; ++i) walk.step(i, slid(i, pose_at(i)), pose_at(i));
  const Eigen::Isometry3d before =
      walk.step(100, slid(100, pose_at(100)), pose_at(100)) * slid(100, pose_at(100)).inverse();
  for (int i = 101; i < 150; ++i) {
    const Eigen::Isometry3d given = slid(i, pose_at(i)), found = walk.step(i, given, pose_at(i), 0);
    EXPECT_LT((found.matrix() - (before * given).matrix()).norm(), 1e-12);
  }
}

TEST(DriftFilter, ADirectionThatNothingMeasuresStaysAsGiven) {
  Walk walk;
  const Eigen::Translation3d off(0.03, 0.03, 0);
  Eigen::Isometry3d found;
  for (int i = 0; i < 100; ++i) found = walk.step(i, i < 20 ? pose_at(i) : off * pose_at(i), pose_at(i), 1);
  EXPECT_TRUE(walk.ever_drifted);
  EXPECT_NEAR(found.translation().x(), pose_at(99).translation().x(), 0.006);
  // Rotations, which nothing measures either, share in what is corrected.
  EXPECT_NEAR(found.translation().y(), 0.03 + pose_at(99).translation().y(), 0.01);
}

TEST(DriftFilter, AJumpThatStaysIsTakenOver) {
  Walk walk;
  for (int i = 0; i < 30; ++i) walk.step(i, pose_at(i), pose_at(i));
  const Eigen::Translation3d off(0.2, -0.1, 0.05);
  DriftFilter filter(walk.state, SensorKind::depth_camera, resolution, Eigen::Vector3d::UnitZ());
  filter.advance(off * pose_at(30));
  filter.jump(off.inverse() * Eigen::Isometry3d::Identity());
  EXPECT_LT(error_m(filter.pose(), pose_at(30)), 1e-9);
  for (int i = 31; i < 60; ++i)
    EXPECT_LT(error_m(walk.step(i, off * pose_at(i), pose_at(i)), pose_at(i)), 0.005) << i;
}

TEST(DriftFilter, OneWildMeasurementMovesLittle) {
  Walk walk;
  for (int i = 0; i < 100; ++i) walk.step(i, slid(i, pose_at(i)), pose_at(i));
  const Eigen::Isometry3d wild = Eigen::Translation3d(0.05, 0.05, 0) * pose_at(100);
  EXPECT_LT(error_m(walk.step(100, slid(100, pose_at(100)), wild), pose_at(100)), 0.015);
}

// What a scan tells of its pose and of its sensor's error where it sees again what was seen long ago.

using namespace octosurf::alignment;

using test::degree;

constexpr double voxel_m = 0.02;

Eigen::Isometry3d view(int i) {
  const double turn = 0.4 * i;
  const Eigen::Vector3d eye =
      middle_of_room + Eigen::Vector3d(0.4 * std::cos(turn), 0.5 * std::sin(turn), 0.1 * (i % 3));
  return look_at(
      eye, middle_of_room + Eigen::Vector3d(2 * std::cos(turn + 0.5), 2.5 * std::sin(turn + 0.5), -0.6));
}

/// A sensor's error made of its readings, as SensorErrors has it.
void err(Scan& scan, const Eigen::Vector3d& tilt, double scale, double bend = 0) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(tilt.norm(), (tilt + Eigen::Vector3d(0, 0, 1e-12)).normalized()).toRotationMatrix();
  for (Eigen::Vector3f& point : scan.points) {
    const Eigen::Vector3d p = point.cast<double>();
    const double u = p.x() / p.z() / 0.6;
    point = ((1 + scale + bend * p.z() * u * u) * (R * p)).cast<float>();
  }
}

/// Patches as they were seen on a way that ended long ago, and scans beside them.
class Revisits : public testing::Test {
 protected:
  std::vector<PatchObservation> observations(const Scan& scan) {
    sensing::NoiseModel noise{Parameters()};
    noise.observe(scan);
    const PoseSearch search(*map_, surfaces_, scan, noise, {0, 4}, scan.T_map_sensor, AlignmentReach());
    return observe(scan, scan.T_map_sensor, search.fitter().lay(scan.T_map_sensor).readings, patches_,
                   SensorKind::depth_camera, voxel_m);
  }
  Scan scan(int i) { return camera_scan(furnished_room(), view(i), rng_, camera_); }
  void remember(const Scan& scan) {
    for (PatchObservation& observation : observations(scan)) {
      alignment::Observation now;
      now.weight = static_cast<float>(observation.weight);
      now.distance = static_cast<float>(observation.distance);
      now.by_error = observation.by_error.cast<float>();
      observation.patch.add(now, 0, revisit_span_m);
      patches_.set(observation.key, observation.patch);
    }
  }
  Revisit revisit(const Scan& scan, double travelled_m = 10) {
    return measure(observations(scan), travelled_m, SensorErrors::Zero(), 0.001, voxel_m);
  }

  Camera camera_{.width = 240, .height = 180, .focal = 170, .noise = 0.003};
  std::mt19937_64 rng_ = rng();
  std::shared_ptr<const Snapshot> map_ = map_of_rectangles(furnished_room(), middle_of_room, voxel_m);
  NearSurfaces surfaces_;
  alignment::SeenPatches patches_;
};

TEST_F(Revisits, TellHowFarThePoseIsOff) {
  for (int i = 0; i < 16; ++i) remember(scan(i));
  for (int i = 0; i < 16; ++i) {
    Scan again = scan(i);
    const Eigen::Isometry3d truth = again.T_map_sensor;
    again.T_map_sensor = octosurf::alignment::moved(truth, any_twist(rng_, 0.01, 0.3 * degree));
    const Revisit r = revisit(again);
    ASSERT_GE(r.motion.size(), 3) << i;
    const auto off = (r.directions * twist_between(again.T_map_sensor, truth)).eval();
    for (Eigen::Index k = 0; k < r.motion.size(); ++k)
      EXPECT_NEAR(r.motion[k], off[k], 6 * std::sqrt(r.variances[k]) + 0.0005) << i << ' ' << k;
  }
}

TEST_F(Revisits, OfWhatWasSeenJustNowTellNothing) {
  for (int i = 0; i < 16; ++i) remember(scan(i));
  EXPECT_EQ(revisit(scan(0), 0.9 * revisit_span_m).patches, 0U);
  EXPECT_GT(revisit(scan(0), 1.1 * revisit_span_m).patches, 50U);
}

/// The same error in the patches and in the scan: what is left of it is as by_error says.
TEST_F(Revisits, TellWhatASensorsErrorMakesOfThem) {
  SensorErrors errors = SensorErrors::Zero();
  errors << 0.4 * degree, -0.3 * degree, 0.2 * degree, 0.006, 0, 0, 0, 0, 0.002, 0;
  const auto seen = [&](int i) {
    Scan scan = this->scan(i);
    err(scan, errors.head<3>(), errors[3], errors[8]);
    return scan;
  };
  for (int i = 0; i < 16; ++i) remember(seen(i));
  double without = 0, with = 0;
  for (int i = 0; i < 8; ++i) {
    const Revisit r = revisit(seen(2 * i + 1));
    without += r.motion.squaredNorm();
    with += (r.motion - r.by_error * errors).squaredNorm();
  }
  EXPECT_LT(with, without / 4);
}

/// A bend over the picture is in no motion: a single scan beside patches that were seen from elsewhere tells
/// it.
TEST_F(Revisits, TellABendThatNoMotionExplains) {
  SensorErrorCovariance information = SensorErrorCovariance::Identity() / (0.002 * 0.002);
  SensorErrors right = SensorErrors::Zero();
  const double bend = 0.003;
  const auto seen = [&](int i) {
    Scan scan = this->scan(i);
    err(scan, Eigen::Vector3d::Zero(), 0, bend);
    return scan;
  };
  for (int i = 0; i < 16; ++i) remember(seen(i));
  for (int i = 0; i < 16; ++i) {
    const Revisit r = revisit(seen(i));
    information += r.error_information;
    right += r.error_vector;
  }
  const SensorErrors found = information.ldlt().solve(right);
  EXPECT_NEAR(found[8], bend, 0.3 * bend);
}

TEST_F(Revisits, AFewPatchesTellNothing) {
  remember(scan(0));
  std::vector<PatchObservation> few = observations(scan(0));
  few.resize(8);
  const Revisit r = measure(few, 10, SensorErrors::Zero(), 0.001, voxel_m);
  EXPECT_EQ(r.motion.size(), 0);
  EXPECT_EQ(r.error_information.norm(), 0);
}

// Exact poses over two plates with little upright between them were corrected by a patch that was wrong.
TEST(Revisit, APatchAloneDeterminesNothing) {
  const auto patch = [](const Eigen::Vector3d& arm, const Eigen::Vector3d& normal) {
    PatchObservation observation;
    observation.by_pose << arm.cross(normal), normal;
    observation.weight = 1e8;
    observation.patch.past.weight = 1e8F;
    return observation;
  };
  std::vector<PatchObservation> seen;
  for (int i = 0; i < 16; ++i) seen.push_back(patch({0.3 * (i % 4), 0.3 * (i / 4), -1}, {0, 0, 1}));
  const auto determined = [&] {
    const Revisit r = measure(seen, 10, SensorErrors::Zero(), 0.001, voxel_m);
    // How far along x is it in the directions that are measured?
    Twist along_x = Twist::Zero();
    along_x[3] = 1;
    return (r.directions * along_x).norm();
  };
  EXPECT_LT(determined(), 1e-3);
  seen.push_back(patch({1, 0, 0}, {-1, 0, 0}));
  EXPECT_LT(determined(), 1e-3);
  seen.push_back(patch({1, 0, -0.6}, {-1, 0, 0}));
  EXPECT_GT(determined(), 0.5);
}

// Poses that fit the walls of a room that looks the same when turned by 180°, but not what stands in it.

enum class Sensor { lidar, camera };

/// Walls, and in the hall pillars, about 0 0; three blocks without symmetry, a little elsewhere in each
/// world.
struct Room {
  Scene scene;
  Eigen::Vector2d half;

  Room(bool hall, std::mt19937_64& rng) : half(hall ? 6 : 2.5, hall ? 2.5 : 2) {
    std::uniform_real_distribution<double> anywhere(-0.1, 0.1);
    constexpr double floor = 0.013;  // not on a face of voxels
    const double ceiling = hall ? 3 : 2.4;
    scene.box({-half.x(), -half.y(), floor}, {half.x(), half.y(), ceiling});
    for (const double x : {-2.0, 2.0})
      for (const double y : {-1.2, 1.2})
        if (hall) scene.box({x - 0.2, y - 0.2, floor}, {x + 0.2, y + 0.2, ceiling});
    const auto block = [&](double x, double y, double width, double depth, double height) {
      const Eigen::Vector3d corner(x + anywhere(rng), y + anywhere(rng), floor);
      scene.box(corner, corner + Eigen::Vector3d(width, depth, height));
    };
    block(-0.76 * half.x(), 0.4 * half.y(), 0.8, 0.6, 0.9);
    block(0.5 * half.x(), -0.78 * half.y(), 0.8, 0.5, 0.7);
    block(0.3, 0.4, 0.5, 0.9, 1.1);
  }
};

Scan scan_at(const Room& room, Sensor sensor, double t, std::mt19937_64& rng) {
  const Eigen::Vector3d eye(0.55 * room.half.x() * std::sin(t), 0.55 * room.half.y() * std::sin(2 * t + 0.5),
                            1.4);  // above the blocks
  if (sensor == Sensor::lidar)
    return spinning_scan(room.scene,
                         Eigen::Translation3d(eye) * Eigen::AngleAxisd(t, Eigen::Vector3d::UnitZ()), rng,
                         rings(-0.5, 0.03, 32), 360, 0.01);
  const Eigen::Vector3d ahead(std::cos(2.5 * t), std::sin(2.5 * t), -0.35);
  return camera_scan(room.scene, look_at(eye, eye + ahead), rng,
                     {.width = 160, .height = 120, .focal = 110, .noise = 0.004});
}

Mapper mapped(const Room& room, Sensor sensor, std::mt19937_64& rng) {
  Mapper mapper(of_voxels(0.05));
  const int scans = sensor == Sensor::lidar ? 20 : 50;
  for (int i = 0; i < scans; ++i) mapper.insert(scan_at(room, sensor, 2 * std::numbers::pi * i / scans, rng));
  return mapper;
}

const Eigen::Isometry3d half_turn(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()));

/// Near the true pose, or near the one that the walls fit as well.
Scan guessed(Scan scan, bool turned, std::mt19937_64& rng) {
  const Eigen::Isometry3d T = turned ? half_turn * scan.T_map_sensor : scan.T_map_sensor;
  scan.T_map_sensor = alignment::moved(T, any_twist(rng, 0.15, 2 * degree));
  return scan;
}

class Contradiction : public testing::TestWithParam<std::tuple<bool, Sensor>> {};

TEST_P(Contradiction, RefutesTheTurnedPoseAndKeepsTheRightOne) {
  const auto [hall, sensor] = GetParam();
  std::mt19937_64 rng = test::rng();
  const Room room(hall, rng);
  const Mapper mapper = mapped(room, sensor, rng);
  Localizer blind(mapper.snapshot()), seeing(mapper.map());  // without the octree, and with it
  std::uniform_real_distribution<double> anywhere(0, 2 * std::numbers::pi);
  int right = 0, kept = 0, turned = 0, taken = 0;
  for (int i = 0; i < 12; ++i) {
    const Scan scan = scan_at(room, sensor, anywhere(rng), rng);
    const auto is_right = [&](const Alignment& found) {
      const Twist off = alignment::twist_between(scan.T_map_sensor, found.T_map_sensor);
      return found.outcome == AlignmentOutcome::corrected && off.tail<3>().norm() < 0.02;
    };
    const Scan near = guessed(scan, false, rng), far = guessed(scan, true, rng);
    right += is_right(blind(near));
    kept += is_right(seeing(near));
    turned += blind(far).outcome == AlignmentOutcome::corrected;
    const Alignment found = seeing(far);
    // A camera that sees none of the blocks, and where none would stand, cannot tell: hardly any contradict.
    taken += found.outcome == AlignmentOutcome::corrected &&
             (sensor == Sensor::lidar || found.contradicted > 0.01);
  }
  EXPECT_GE(right, 6);
  EXPECT_EQ(kept, right);
  EXPECT_GE(turned, 2) << "or the scene is no test";
  EXPECT_LE(2 * taken, turned);  // in the hall the right pose, 8 m away, is not always found
}

INSTANTIATE_TEST_SUITE_P(Scenes, Contradiction,
                         testing::Combine(testing::Bool(), testing::Values(Sensor::lidar, Sensor::camera)));

TEST(Localizer, FindsPosesOfAnotherFrame) {
  std::mt19937_64 rng = test::rng();
  const Room room(false, rng);
  const Mapper mapper = mapped(room, Sensor::lidar, rng);
  Localizer localizer(mapper.map(), {.translation_m = 2, .rotation_rad = std::numbers::pi});
  for (int i = 0; i < 8; ++i) {
    Scan scan = scan_at(room, Sensor::lidar, 0.7 * i, rng);
    const Eigen::Isometry3d truth = scan.T_map_sensor;
    Twist off = Twist::Zero();
    off << 0, 0, 0.8 * i, 0.9, -0.6, 0.1;
    scan.T_map_sensor = alignment::moved(truth, off);
    const Alignment found = localizer(scan);
    ASSERT_EQ(found.outcome, AlignmentOutcome::corrected) << i;
    EXPECT_LT(alignment::twist_between(truth, found.T_map_sensor).norm(), 0.01) << i;
  }
}

/// Near the pose that the walls fit as well, and where only floor and ceiling fit.
TEST(AlignedMap, ASessionInAnotherFrameIsLeftOut) {
  for (const auto& [turn, x, y] : {std::array{181.7, 0.1, 0.06}, std::array{155.0, 0.7, -0.5}}) {
    std::mt19937_64 rng = test::rng();
    const Room room(false, rng);
    Mapper mapper(mapped(room, Sensor::lidar, rng).release());  // resumed
    int left_out = 0;
    for (int i = 0; i < 6; ++i) {
      Scan scan = scan_at(room, Sensor::lidar, 0.3 + 0.1 * i, rng);
      scan.T_map_sensor = Eigen::Translation3d(x, y, 0) *
                          Eigen::AngleAxisd(turn * degree, Eigen::Vector3d::UnitZ()) * scan.T_map_sensor;
      left_out += mapper.insert(scan).alignment.outcome == AlignmentOutcome::rejected;
    }
    EXPECT_GE(left_out, 4) << turn;
  }
}

}  // namespace
}  // namespace octosurf::test
