// What may be done to the input without changing what is found: the surfaces must follow.
#include "same_surfaces.hpp"
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"

#include <octosurf/adapters/paper_detector.hpp>

namespace octosurf {
namespace {

using test::CheckedMapper;
using test::expect_same;
using test::other_points;
using test::same_voxels;
using test::Scene;

struct World {
  Scene scene;
  std::vector<Eigen::Isometry3d> poses;
};

/// Two faces nearer than this, one in front of the other, are within the reach of one plane, and which of
/// their points it takes hangs on the voxels' borders (a step of 21 mm on a box top: 2.7° between two maps).
constexpr double least_step = 0.04;  // m

struct Box {
  Eigen::Vector3d low, high;
};

bool near_faces(const Box& a, const Box& b) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double x : {a.low[axis], a.high[axis]})
      for (const double y : {b.low[axis], b.high[axis]})
        if (x != y && std::fabs(x - y) < least_step) return true;  // equal: both stand on the floor
  return false;
}

/// A room with two to four boxes, and cameras that look around in it.
World random_world(std::mt19937_64& rng, int scans) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  World world;
  std::vector<Box> boxes{{{-1.6, -1.3, 0.013}, {1.6, 1.3, 2.2}}};  // the room
  const std::size_t count = 3 + rng() % 3;
  while (boxes.size() < count) {
    const Eigen::Vector3d low(0.9 * uniform(rng) - 0.2, 0.8 * uniform(rng) - 0.2, 0.013);
    const Box box{low, low + Eigen::Vector3d(0.45 + 0.15 * uniform(rng), 0.45 + 0.15 * uniform(rng),
                                             0.4 + 0.2 * uniform(rng))};
    if (std::none_of(boxes.begin(), boxes.end(), [&](const Box& other) { return near_faces(box, other); }))
      boxes.push_back(box);
  }
  for (const Box& box : boxes) world.scene.box(box.low, box.high);
  for (int i = 0; i < scans; ++i) {
    const double a = 2.4 * i;
    const Eigen::Vector3d eye(0.4 * uniform(rng), 0.3 * uniform(rng), 1.4 + 0.2 * uniform(rng));
    world.poses.push_back(test::look_at(eye, eye + Eigen::Vector3d(std::cos(a), std::sin(a), -0.6)));
  }
  return world;
}

std::vector<Scan> scans_of(const World& world, std::mt19937_64& rng) {
  std::vector<Scan> scans;
  for (const Eigen::Isometry3d& pose : world.poses)
    scans.push_back(test::camera_scan(world.scene, pose, rng));
  return scans;
}

std::vector<SurfacePtr> mapped(const std::vector<Scan>& scans, const Parameters& parameters = {}) {
  CheckedMapper under_test(parameters);
  for (const Scan& scan : scans) under_test.insert(scan);
  test::expect_guarantees(under_test.mapper.map());
  return under_test.surfaces();
}

/// What a room gives, mapped once a world: each test changes the scans in its own way.
class Metamorphic : public ::testing::Test {
 protected:
  std::mt19937_64 rng_ = test::rng();
  std::vector<Scan> scans_ = scans_of(random_world(rng_, 9), rng_);

  const std::vector<SurfacePtr>& unchanged() const {
    static std::uint64_t of = 0;
    static std::vector<SurfacePtr> surfaces;
    if (surfaces.empty() || of != test::seed()) surfaces = mapped(scans_);
    of = test::seed();
    return surfaces;
  }
  void expect_same_when_moved(const Eigen::Isometry3d& T, const test::Bounds& bounds) const {
    std::vector<Scan> moved;
    for (const Scan& scan : scans_) moved.push_back(test::moved(scan, T));
    expect_same(unchanged(), mapped(moved), T, bounds);
  }
  void expect_same_from(const std::vector<Scan>& changed) const {
    expect_same(unchanged(), mapped(changed), Eigen::Isometry3d::Identity(), other_points);
  }
};

TEST_F(Metamorphic, MovedByWholeVoxelsFarAway) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(100, -100, 20);
  expect_same_when_moved(T, same_voxels);
}

TEST_F(Metamorphic, TurnedByAQuarter) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  expect_same_when_moved(T, same_voxels);
}

/// Any turn, and a shift.
Eigen::Isometry3d random_turn(std::mt19937_64& rng, const Eigen::Vector3d& shift) {
  std::normal_distribution<double> gauss;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      Eigen::Quaterniond(gauss(rng), gauss(rng), gauss(rng), gauss(rng)).normalized().toRotationMatrix();
  T.translation() = shift;
  return T;
}

// A turn about an origin 100 m off: what is computed about the map's origin loses its digits there.
TEST_F(Metamorphic, TurnedByAnythingFarAway) {
  expect_same_when_moved(random_turn(rng_, {100.007, -99.991, 50.013}), other_points);
}

TEST_F(Metamorphic, PointsInAnotherOrder) {
  Parameters parameters;
  parameters.surfaces.range_noise = 0.001;  // its estimate does look at the order
  Mapper in_order(parameters), shuffled(parameters);
  for (Scan& scan : scans_) {
    in_order.insert(scan);
    std::shuffle(scan.points.begin(), scan.points.end(), rng_);
    shuffled.insert(scan);
  }
  expect_same(in_order.snapshot()->surfaces, shuffled.snapshot()->surfaces, Eigen::Isometry3d::Identity(),
              same_voxels);
  const Map::Size a = in_order.map().size(), b = shuffled.map().size();
  EXPECT_NEAR(static_cast<double>(a.points), static_cast<double>(b.points),
              0.005 * static_cast<double>(a.points));
}

// Readings in no order tell nothing of the noise, which is then taken to be sensor_noise.
TEST_F(Metamorphic, PointsInAnotherOrderNoiseEstimated) {
  unchanged();
  for (Scan& scan : scans_) std::shuffle(scan.points.begin(), scan.points.end(), rng_);
  expect_same_from(scans_);
}

TEST_F(Metamorphic, PointsInAnotherOrderSameOctree) {
  scans_.resize(4);
  Parameters parameters;
  parameters.occupancy.preserve_surfaces = false;
  Mapper in_order(parameters), shuffled(parameters);
  for (Scan& scan : scans_) {
    in_order.insert(scan);
    std::shuffle(scan.points.begin(), scan.points.end(), rng_);
    shuffled.insert(scan);
  }
  std::size_t different = 0, points = 0;
  in_order.map().for_each_point([&](const OccupancyView::Voxel& v) {
    ++points;
    const OccupancyView::Voxel same = shuffled.map().at(v.point);
    different += same.view.isZero() || (same.point - v.point).norm() > 0.001;
  });
  EXPECT_EQ(in_order.map().size().nodes, shuffled.map().size().nodes);
  EXPECT_EQ(points, shuffled.map().size().points);
  EXPECT_EQ(different, 0U);
}

// What is seen again is evidence, and weighs more.
TEST_F(Metamorphic, EveryScanTwice) {
  std::vector<Scan> twice;
  for (const Scan& scan : scans_) twice.insert(twice.end(), 2, scan);
  expect_same_from(twice);
}

TEST_F(Metamorphic, ScansInAnotherOrder) {
  unchanged();
  std::shuffle(scans_.begin(), scans_.end(), rng_);
  expect_same_from(scans_);
}

TEST_F(Metamorphic, EveryScanInTwoHalves) {
  std::vector<Scan> halves;
  for (const Scan& scan : scans_) {
    const auto middle = scan.points.begin() + static_cast<std::ptrdiff_t>(scan.points.size() / 2);
    for (const bool upper : {true, false}) {
      halves.push_back(scan);
      halves.back().points = upper ? std::vector<Eigen::Vector3f>(scan.points.begin(), middle)
                                   : std::vector<Eigen::Vector3f>(middle, scan.points.end());
    }
  }
  expect_same_from(halves);
}

TEST_F(Metamorphic, InvariantsHoldForAnyParameters) {
  for (int round = 0; round < 3; ++round) {
    std::uniform_real_distribution<double> uniform(0, 1);
    const double d = 0.025 + 0.05 * uniform(rng_);
    Parameters p = round % 3 == 2 ? Parameters::paper(d) : Parameters{};
    p.occupancy.resolution = d;
    if (round % 2 == 1) p.surfaces.max_hole_size = p.occupancy.resolution * (1.2 + 6 * uniform(rng_));
    p.occupancy.preserve_surfaces = round % 2 == 0;
    SCOPED_TRACE("round " + std::to_string(round) + " resolution " + get_parameter(p, "resolution") + " h " +
                 get_parameter(p, "max_hole_size"));
    // Boxes move between scans: surfaces come, shrink and go.
    CheckedMapper under_test(p, paper_detector());
    for (int i = 0; i < 3; ++i)
      for (const Scan& scan : scans_of(random_world(rng_, 3), rng_)) under_test.insert(scan);
    test::expect_guarantees(under_test.mapper.map());
    EXPECT_FALSE(under_test.surfaces().empty());
  }
}

}  // namespace
}  // namespace octosurf
