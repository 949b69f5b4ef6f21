// What a scan tells of its pose and of its sensor's error where it sees again what was seen long ago.
#include "alignment/revisit.hpp"

#include "alignment/pose_search.hpp"
#include "alignment/surfaces_by_hand.hpp"
#include "support/degree.hpp"

namespace octosurf::test {
namespace {

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

}  // namespace
}  // namespace octosurf::test
