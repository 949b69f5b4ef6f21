#include "cylinders/cylinders.hpp"

#include "support/map_state.hpp"
#include "surfaces/blobs.hpp"

namespace octosurf::cylinders {
namespace {

constexpr double pi = std::numbers::pi;

/// A lateral surface about the pose's z axis as seen from its +x side, over `span` about that direction.
struct Seen {
  double radius = 0.15, length = 1, span = 2 * pi / 3, noise = 0.003, distance = 1.5;

  Scan scan(const Eigen::Isometry3d& pose, double resolution, std::mt19937_64& rng) const {
    std::normal_distribution<double> gauss(0, noise);
    Scan scan;
    scan.T_map_sensor.translation() = pose * Eigen::Vector3d(radius + distance, 0, 0);
    const double spacing = 0.45 * resolution;
    for (double z = -length / 2; z <= length / 2; z += spacing)
      for (double a = -span / 2; a <= span / 2; a += spacing / radius) {
        const Eigen::Vector3d p = pose * Eigen::Vector3d(radius * std::cos(a), radius * std::sin(a), z) -
                                  scan.T_map_sensor.translation();
        scan.points.push_back((p * (1 + gauss(rng) / p.norm())).cast<float>());
      }
    return scan;
  }
};

void wait(surfaces::MapState& state, const Scan& scan) {
  for (const occupancy::VoxelPoint& p : test::occupy(state, scan).appeared)
    state.queue.fresh.push_back(p.key);
  std::sort(state.queue.fresh.begin(), state.queue.fresh.end());
}

void update(surfaces::MapState& state) {
  surfaces::Ledger ledger(state);
  std::vector<PointId> pending;
  for (const geometry::VoxelKey key : state.queue.fresh) pending.push_back(ledger.window.find(key));
  state.queue.fresh.clear();
  update_cylinders(ledger, pending, {pending});
  ++state.revision;
  state.cylinders.publish(state.revision);
}

TEST(DetectCylinders, FromOneSide) {
  std::mt19937_64 rng = test::rng();
  struct Case {
    double radius, span_deg, resolution, noise, largest_error, largest_tilt_deg;
  };
  for (const Case& c : {Case{0.15, 120, 0.02, 0.003, 0.005, 0.5}, Case{0.15, 160, 0.02, 0.003, 0.003, 0.5},
                        Case{0.3, 120, 0.02, 0.003, 0.005, 0.5}, Case{0.08, 150, 0.02, 0.003, 0.004, 0.5},
                        Case{0.02, 160, 0.01, 0.002, 0.002, 0.5}, Case{0.15, 120, 0.01, 0.003, 0.003, 0.5}}) {
    for (int round = 0; round < 8; ++round) {
      const Eigen::Isometry3d pose = test::random_pose(rng);
      surfaces::MapState state(test::of_voxels(c.resolution));
      Seen seen;
      seen.radius = c.radius;
      seen.span = c.span_deg * pi / 180;
      seen.noise = c.noise;
      wait(state, seen.scan(pose, c.resolution, rng));
      update(state);
      ASSERT_EQ(state.cylinders.size(), 1U) << "radius " << c.radius << ", round " << round;
      const Cylinder& found = *state.cylinders.begin()->second.published;
      EXPECT_NEAR(found.radius_m, c.radius, c.largest_error);
      const double tilt = std::acos(std::min(1.0, std::fabs(found.axis.dot(pose.linear().col(2)))));
      EXPECT_LT(tilt * 180 / pi, c.largest_tilt_deg);
      EXPECT_NEAR(found.length_m, seen.length, 0.06);
      // Rays graze the boundaries: there noise runs around the lateral surface, three sigma of it at either.
      EXPECT_NEAR(found.span_rad, seen.span, 0.2 + 6 * c.noise / c.radius);
      // Upward when born, or level to 1e-3; then it is fitted again, and either fit leans by its error.
      EXPECT_GT(found.axis.z(), -1e-3 - 2 * c.largest_tilt_deg * pi / 180);
    }
  }
}

TEST(DetectCylinders, FindsItAmongOtherPoints) {
  std::mt19937_64 rng(test::seed());
  const Eigen::Isometry3d pose = test::random_pose(rng);
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  Seen seen;
  surfaces::MapState state{Parameters{}};
  Scan scan = seen.scan(pose, 0.02, rng);
  for (int i = 0; i < 150; ++i)
    scan.points.push_back(
        (pose * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)) - scan.T_map_sensor.translation())
            .cast<float>());
  wait(state, scan);
  update(state);
  ASSERT_EQ(state.cylinders.size(), 1U);
  EXPECT_NEAR(state.cylinders.begin()->second.shape.radius, seen.radius, 0.01);
}

TEST(DetectCylinders, NotWhatIsShorterThanItsRadiusOrSeenTooLittleOf) {
  std::mt19937_64 rng(test::seed());
  Seen disc, strip, thin;
  disc.length = 0.12;
  strip.span = 40 * pi / 180;
  strip.radius = 0.3;
  thin.radius = 0.02;  // one voxel: no telling it from a square bar
  for (const Seen& seen : {disc, strip, thin}) {
    surfaces::MapState state{Parameters{}};
    wait(state, seen.scan(test::random_pose(rng), 0.02, rng));
    update(state);
    EXPECT_EQ(state.cylinders.size(), 0U) << seen.radius << " " << seen.length << " " << seen.span;
  }
}

TEST(DetectCylinders, ItsInsideIsNotItsOutside) {
  // The near half of a wide tube from outside, the far half from inside: on one lateral surface, but a foot
  // can only stand on the former.
  std::mt19937_64 rng(test::seed());
  surfaces::MapState state{Parameters{}};
  const Eigen::Isometry3d pose = test::random_pose(rng);
  Seen outside, inside;
  outside.radius = inside.radius = 0.3;
  inside.distance = -0.55;
  wait(state, outside.scan(pose, 0.02, rng));
  update(state);
  ASSERT_EQ(state.cylinders.size(), 1U);
  Eigen::Isometry3d turned = pose;
  turned.rotate(Eigen::AngleAxisd(pi, Eigen::Vector3d::UnitZ()));
  std::vector<geometry::VoxelKey> inner_keys;
  for (const occupancy::VoxelPoint& p : test::occupy(state, inside.scan(turned, 0.02, rng)).appeared)
    inner_keys.push_back(p.key);
  state.queue.fresh = inner_keys;
  std::sort(state.queue.fresh.begin(), state.queue.fresh.end());
  update(state);
  ASSERT_EQ(state.cylinders.size(), 1U);
  EXPECT_NEAR(state.cylinders.begin()->second.shape.radius, 0.3, 0.01);
  ASSERT_GT(inner_keys.size(), 500U);
  for (const geometry::VoxelKey key : inner_keys) EXPECT_EQ(state.cylinders.owner(key), 0U);
}

TEST(DetectCylinders, ASurfaceTakesPointsAway) {
  std::mt19937_64 rng(test::seed());
  surfaces::MapState state{Parameters{}};
  const Eigen::Isometry3d pose = test::random_pose(rng);
  wait(state, Seen{}.scan(pose, 0.02, rng));
  update(state);
  ASSERT_EQ(state.cylinders.size(), 1U);
  const surfaces::CylinderModel& cylinder = state.cylinders.begin()->second;
  const std::size_t before = cylinder.inliers.size();
  surfaces::Ledger ledger(state);
  const Eigen::Vector3d n = pose.linear().col(0);
  surfaces::SurfaceModel& surface = state.surfaces.create({n, n.dot(pose.translation())}, pose.translation());
  std::vector<geometry::VoxelKey> half;
  for (const auto& [key, inlier] : cylinder.inliers)
    if (half.size() < before / 2) half.push_back(key);
  for (const geometry::VoxelKey key : half) {
    ledger.give(ledger.window.find(key), surface);
    EXPECT_EQ(state.cylinders.owner(key), 0U);
  }
  EXPECT_EQ(cylinder.inliers.size(), before - before / 2);
  EXPECT_EQ(state.cylinders.touched().size(), 1U);
}

TEST(DetectCylinders, VanishedPointsLeaveAndTooFewEndIt) {
  std::mt19937_64 rng(test::seed());
  surfaces::MapState state{Parameters{}};
  wait(state, Seen{}.scan(test::random_pose(rng), 0.02, rng));
  update(state);
  ASSERT_EQ(state.cylinders.size(), 1U);
  surfaces::Ledger ledger(state);
  occupancy::OccupancyDelta delta;
  for (const auto& [key, inlier] : state.cylinders.begin()->second.inliers)
    delta.vanished.push_back(ledger.window[ledger.window.find(key)]);
  const auto all = delta.vanished;
  delta.vanished.resize(10);
  retract_cylinders(ledger, delta);
  update_cylinders(ledger, {}, {});
  ASSERT_EQ(state.cylinders.size(), 1U);
  EXPECT_EQ(state.cylinders.begin()->second.inliers.size(), all.size() - 10);
  delta.vanished.assign(all.begin() + 10, all.end() - 5);
  retract_cylinders(ledger, delta);
  update_cylinders(ledger, {}, {});
  EXPECT_EQ(state.cylinders.size(), 0U);
  EXPECT_EQ(state.cylinders.next_id(), 2U);
}

}  // namespace
}  // namespace octosurf::cylinders
