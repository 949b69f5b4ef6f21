// What may be done to the input without changing what is found: the surfaces must follow.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <numbers>
#include <random>
#include <string>

namespace octosurf {
namespace {

using test::CheckedMapper;
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

constexpr double large = 0.12;    // m²: surfaces that must be found whatever the voxels' borders are
constexpr double counted = 0.05;  // m²: what a foot needs; as many of them before and after

/// How far a large surface may differ.
struct Bounds {
  double area;       ///< share of it
  bool along_rings;  ///< or a voxel along its rings, if that is more
  double angle_deg, offset_m;
};

/// The same readings in the same voxels: sums are rounded in another order, points are stored to 1/256 voxel
/// (0.08 mm, a hundredth of that in the mean of hundreds), and a few voxels on an edge may fall to the other
/// face.
constexpr Bounds same_voxels{0.02, false, 0.05, 0.0001};

/// The same readings, but others of them decide for a voxel or the voxels are cut otherwise, so that planes
/// are fitted to other points. Were the readings' noise of σ = 2 mm drawn anew, a fit to n ≥ 300 voxels of
/// width L ≥ 0.2 m would turn by √12·σ/(L·√n) = 0.11° and move by σ/√n = 0.12 mm; two fits differ by √2 of
/// it, and 4 of these are 0.65° and 0.65 mm. The offset is taken in the middle of the boundary, up to 0.1 m
/// from that of the points: 1.1 mm more.
constexpr Bounds other_points{0.1, true, 0.65, 0.0018};

/// The same readings in the same voxels with other weights, for in no order they tell nothing of how they
/// scatter. Two weighted means of the same readings differ by no more than fits to other readings do.
constexpr Bounds other_weights{same_voxels.area, true, other_points.angle_deg, other_points.offset_m};

double length_of_rings(const Surface& surface) {
  double length = 0;
  const auto add = [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) length += (ring[(i + 1) % ring.size()] - ring[i]).norm();
  };
  for (const Polygon& polygon : surface.polygons) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  return length;
}

/// What of a surface's area hangs on where the voxels' borders lie: a voxel along its rings, for whether
/// noise ever reaches a voxel beyond an edge does (seed 7503052: a box top of 0.42 m, 1.2 cm along its
/// edges).
double area_in_doubt(const Surface& surface) { return surface.resolution * length_of_rings(surface); }

/// Every large surface of `a`, moved by T, is one of `b`.
void expect_follow(const std::vector<SurfacePtr>& a, const std::vector<SurfacePtr>& b,
                   const Eigen::Isometry3d& T, const Bounds& bounds) {
  std::size_t compared = 0;
  for (const SurfacePtr& s : a) {
    if (s->area_m2 < large) continue;
    ++compared;
    const Eigen::Vector3d normal = T.linear() * s->plane.normal;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : s->boundary) middle += p / static_cast<double>(s->boundary.size());
    // Of those near it the one most like it in area.
    double area = 1e9, angle_deg = 0, offset_m = 0;
    for (const SurfacePtr& o : b) {
      const double angle = std::atan2(o->plane.normal.cross(normal).norm(), o->plane.normal.dot(normal));
      const double offset = std::fabs(o->plane.signed_distance(T * middle));
      const double difference = std::fabs(o->area_m2 - s->area_m2) / s->area_m2;
      if (angle > 0.1 || offset > 0.03 || difference >= area) continue;
      area = difference;
      angle_deg = angle * 180 / std::numbers::pi;
      offset_m = offset;
    }
    const std::string what = "surface " + std::to_string(s->id) + " of " + std::to_string(s->area_m2) + " m²";
    const double doubt = bounds.along_rings ? area_in_doubt(*s) / s->area_m2 : 0;
    EXPECT_LE(area, std::max(bounds.area, doubt)) << what;
    EXPECT_LE(angle_deg, bounds.angle_deg) << what;
    EXPECT_LE(offset_m, bounds.offset_m) << what;
  }
  EXPECT_GE(compared, 4U);
}

/// `b` has as many surfaces that count as `a`; one whose area is in doubt may stand on either side of the
/// line.
void expect_as_many(const std::vector<SurfacePtr>& a, const std::vector<SurfacePtr>& b) {
  const auto certain = std::count_if(
      a.begin(), a.end(), [](const SurfacePtr& s) { return s->area_m2 - area_in_doubt(*s) >= counted; });
  const auto possible = std::count_if(
      b.begin(), b.end(), [](const SurfacePtr& s) { return s->area_m2 + area_in_doubt(*s) >= counted; });
  EXPECT_LE(certain, possible);
}

void expect_same(const std::vector<SurfacePtr>& a, const std::vector<SurfacePtr>& b,
                 const Eigen::Isometry3d& T, const Bounds& bounds) {
  expect_follow(a, b, T, bounds);
  expect_follow(b, a, T.inverse(), bounds);
  expect_as_many(a, b);
  expect_as_many(b, a);
}

class Metamorphic : public ::testing::Test {
 protected:
  // Of fresh worlds about seven in a hundred tests leave these bounds by a little, and one by a face that is
  // cut otherwise.
  std::uint64_t seed_ = test::seed();
  std::mt19937_64 rng_{seed_};
};

TEST_F(Metamorphic, MovedByWholeVoxelsFarAway) {
  const std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(100, -100, 20);
  std::vector<Scan> moved;
  for (const Scan& scan : scans) moved.push_back(test::moved(scan, T));
  expect_same(mapped(scans), mapped(moved), T, same_voxels);
}

TEST_F(Metamorphic, TurnedByAQuarter) {
  const std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  std::vector<Scan> moved;
  for (const Scan& scan : scans) moved.push_back(test::moved(scan, T));
  expect_same(mapped(scans), mapped(moved), T, same_voxels);
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

TEST_F(Metamorphic, TurnedByAnything) {
  const std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  const Eigen::Isometry3d T = random_turn(rng_, {1.234, 5.678, -3.21});
  std::vector<Scan> moved;
  for (const Scan& scan : scans) moved.push_back(test::moved(scan, T));
  expect_same(mapped(scans), mapped(moved), T, other_points);
}

// A turn about an origin 100 m off: what is computed about the map's origin loses its digits there.
TEST_F(Metamorphic, TurnedByAnythingFarAway) {
  const std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  const Eigen::Isometry3d T = random_turn(rng_, {100.007, -99.991, 50.013});
  std::vector<Scan> moved;
  for (const Scan& scan : scans) moved.push_back(test::moved(scan, T));
  expect_same(mapped(scans), mapped(moved), T, other_points);
}

TEST_F(Metamorphic, PointsInAnotherOrder) {
  std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  Parameters parameters;
  parameters.surfaces.range_noise = 0.001;  // its estimate does look at the order
  Mapper in_order(parameters), shuffled(parameters);
  for (Scan& scan : scans) {
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
  std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  const auto before = mapped(scans);
  for (Scan& scan : scans) std::shuffle(scan.points.begin(), scan.points.end(), rng_);
  expect_same(before, mapped(scans), Eigen::Isometry3d::Identity(), other_weights);
}

TEST_F(Metamorphic, PointsInAnotherOrderSameOctree) {
  std::vector<Scan> scans = scans_of(random_world(rng_, 4), rng_);
  Parameters parameters;
  parameters.occupancy.preserve_surfaces = false;
  Mapper in_order(parameters), shuffled(parameters);
  for (Scan& scan : scans) {
    in_order.insert(scan);
    std::shuffle(scan.points.begin(), scan.points.end(), rng_);
    shuffled.insert(scan);
  }
  std::size_t different = 0, points = 0;
  in_order.map().for_each_point([&](const Map::Voxel& v) {
    ++points;
    const Map::Voxel same = shuffled.map().at(*v.point);
    different += !same.point || (*same.point - *v.point).norm() > 0.001;
  });
  EXPECT_EQ(in_order.map().size().nodes, shuffled.map().size().nodes);
  EXPECT_EQ(points, shuffled.map().size().points);
  EXPECT_EQ(different, 0U);
}

TEST_F(Metamorphic, EveryScanTwice) {
  const std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  std::vector<Scan> twice;
  for (const Scan& scan : scans) twice.insert(twice.end(), 2, scan);
  expect_same(mapped(scans), mapped(twice), Eigen::Isometry3d::Identity(), same_voxels);
}

TEST_F(Metamorphic, ScansInAnotherOrder) {
  std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  const auto before = mapped(scans);
  std::shuffle(scans.begin(), scans.end(), rng_);
  expect_same(before, mapped(scans), Eigen::Isometry3d::Identity(), other_points);
}

TEST_F(Metamorphic, EveryScanInTwoHalves) {
  const std::vector<Scan> scans = scans_of(random_world(rng_, 9), rng_);
  std::vector<Scan> halves;
  for (const Scan& scan : scans) {
    const auto middle = scan.points.begin() + static_cast<std::ptrdiff_t>(scan.points.size() / 2);
    for (const bool upper : {true, false}) {
      halves.push_back(scan);
      halves.back().points = upper ? std::vector<Eigen::Vector3f>(scan.points.begin(), middle)
                                   : std::vector<Eigen::Vector3f>(middle, scan.points.end());
    }
  }
  expect_same(mapped(scans), mapped(halves), Eigen::Isometry3d::Identity(), other_points);
}

TEST_F(Metamorphic, InvariantsHoldForAnyParameters) {
  for (int round = 0; round < 6; ++round) {
    Parameters p = round % 3 == 2 ? Parameters::paper() : Parameters{};
    std::uniform_real_distribution<double> uniform(0, 1);
    if (round % 3 != 2) p.occupancy.resolution = 0.025 + 0.05 * uniform(rng_);
    if (round % 2 == 1) p.surfaces.max_hole_size = p.occupancy.resolution * (1.2 + 6 * uniform(rng_));
    p.occupancy.preserve_surfaces = round % 2 == 0;
    SCOPED_TRACE("round " + std::to_string(round) + " resolution " + get_parameter(p, "resolution") + " h " +
                 get_parameter(p, "max_hole_size"));
    // Boxes move between scans: surfaces come, shrink and go.
    CheckedMapper under_test(p);
    for (int i = 0; i < 4; ++i)
      for (const Scan& scan : scans_of(random_world(rng_, 3), rng_)) under_test.insert(scan);
    test::expect_guarantees(under_test.mapper.map());
    EXPECT_FALSE(under_test.surfaces().empty());
  }
}

}  // namespace
}  // namespace octosurf
