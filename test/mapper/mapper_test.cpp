// Whole scans through the whole way, on scenes whose surfaces are known.
#include "occupancy/octree_bytes.hpp"
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "surfaces/map_state.hpp"

namespace octosurf::mapper {
namespace {

using test::CheckedMapper;
using test::orbit;
using test::Scene;

const Eigen::Vector3d up(0, 0, 1);

/// A camera straight above (x, y), seeing about 1.9 m along x and 2.5 m along y of what is on the ground.
Scan from_above(const Scene& scene, double x, double y, std::mt19937_64& rng) {
  return test::camera_scan(scene, test::look_at({x, y, 2.2}, {x, y, 0}), rng);
}

Scene floor_with_box() {
  Scene scene;
  scene.rectangle({-1.2, -1.2, 0.01}, {2.4, 0, 0}, {0, 2.4, 0});
  scene.box({-0.2, -0.25, 0.01}, {0.2, 0.25, 0.41});
  return scene;
}

static_assert(std::is_constructible_v<Mapper, Map> && !std::is_constructible_v<Mapper, Map&> &&
              !std::is_constructible_v<Mapper, const Map&>);

TEST(Mapper, FloorWallAndBox) {
  std::mt19937_64 rng = test::rng();
  Scene scene = floor_with_box();
  scene.rectangle({1.2, -1.2, 0.01}, {0, 2.4, 0}, {0, 0, 1});
  CheckedMapper under_test;
  for (const Scan& scan : orbit(scene, {0, 0, 0.2}, 1.1, 0.9, 10, rng)) under_test.insert(scan);
  for (const Scan& scan : orbit(scene, {0.4, 0, 0.3}, 0.7, 1.2, 6, rng)) under_test.insert(scan);

  struct Face {
    Eigen::Vector3d normal, point;
    double area;
  };
  const std::vector<Face> faces{{{0, 0, 1}, {0, 0, 0.41}, 0.2},      {{1, 0, 0}, {0.2, 0, 0.2}, 0.2},
                                {{-1, 0, 0}, {-0.2, 0, 0.2}, 0.2},   {{0, 1, 0}, {0, 0.25, 0.2}, 0.16},
                                {{0, -1, 0}, {0, -0.25, 0.2}, 0.16}, {{0, 0, 1}, {1, 1, 0.01}, 5.76 - 0.2}};
  for (const Face& face : faces) {
    const auto found = under_test.on_plane(face.normal, face.point);
    ASSERT_EQ(found.size(), 1U) << face.normal.transpose() << " at " << face.point.transpose();
    EXPECT_NEAR(found[0]->plane.signed_distance(face.point), 0, 0.006);
    EXPECT_NEAR(found[0]->area_m2, face.area, 0.15 * face.area + 0.02);
  }
  EXPECT_EQ(under_test.on_plane({-1, 0, 0}, {1.2, 0, 0.5}).size(), 1U) << "the wall";
  EXPECT_EQ(under_test.surfaces().size(), faces.size() + 1) << "and nothing that is not there";
  test::expect_guarantees(under_test.mapper.map());
}

TEST(Mapper, AFloorGrowsFromStrips) {
  std::mt19937_64 rng = test::rng();
  CheckedMapper under_test;
  double last = 0;
  for (int i = 1; i <= 8; ++i) {
    Scene strip;  // every scan shows another 25 cm
    strip.rectangle({0.25 * (i - 1), 0, 0.01}, {0.25, 0, 0}, {0, 1, 0});
    const ScanReport report = under_test.insert(from_above(strip, 0.25 * i, 0.5, rng));
    const auto floor = under_test.on_plane(up, {0, 0, 0.01});
    ASSERT_EQ(floor.size(), 1U) << "strip " << i;
    EXPECT_EQ(floor[0]->id, 1U);
    EXPECT_GT(floor[0]->area_m2, last + 0.2);
    last = floor[0]->area_m2;
    if (i > 1) {
      EXPECT_THAT(report.grown, ::testing::Contains(1U));
      EXPECT_GE(report.categorized * 100, report.appeared * 95)
          << "in the surface by the scan that brought them";
    }
  }
  EXPECT_NEAR(last, 2, 0.1);
  test::expect_guarantees(under_test.mapper.map());
}

TEST(Mapper, PiecesThatGrowTogetherMerge) {
  for (const bool larger_first : {true, false}) {
    std::mt19937_64 rng = test::rng();
    CheckedMapper under_test;
    Scene small, large, gap;
    small.rectangle({0, 0, 0.01}, {0.4, 0, 0}, {0, 1, 0});
    gap.rectangle({0.4, 0, 0.01}, {0.4, 0, 0}, {0, 1, 0});
    large.rectangle({0.8, 0, 0.01}, {0.9, 0, 0}, {0, 1, 0});
    under_test.insert(from_above(larger_first ? large : small, 0.8, 0.5, rng));
    under_test.insert(from_above(larger_first ? small : large, 0.8, 0.5, rng));
    ASSERT_EQ(under_test.surfaces().size(), 2U);
    const auto before = under_test.mapper.snapshot();
    const ScanReport report = under_test.insert(from_above(gap, 0.8, 0.5, rng));
    ASSERT_EQ(under_test.surfaces().size(), 1U);
    const SurfaceId kept = larger_first ? 1 : 2, gone = larger_first ? 2 : 1;
    const Surface& whole = *under_test.surfaces()[0];
    EXPECT_EQ(whole.id, kept);
    EXPECT_THAT(whole.parents, ::testing::Contains(gone));
    EXPECT_THAT(report.merged, ::testing::Contains(gone));
    EXPECT_NEAR(whole.area_m2, 1.7, 0.1);
    EXPECT_EQ(before->surfaces.size(), 2U) << "snapshots never change";
    test::expect_guarantees(under_test.mapper.map());
  }
}

TEST(Mapper, HolesOverHStayAndSmallerOnesClose) {
  std::mt19937_64 rng = test::rng();
  for (const double half : {0.15, 0.015}) {
    Scene scene;  // a plate 0.8 m × 1 m with a square hole
    scene.rectangle({0, 0, 0.01}, {0.8, 0, 0}, {0, 0.5 - half, 0})
        .rectangle({0, 0.5 + half, 0.01}, {0.8, 0, 0}, {0, 0.5 - half, 0})
        .rectangle({0, 0.5 - half, 0.01}, {0.4 - half, 0, 0}, {0, 2 * half, 0})
        .rectangle({0.4 + half, 0.5 - half, 0.01}, {0.4 - half, 0, 0}, {0, 2 * half, 0});
    CheckedMapper under_test;
    for (const double x : {0.3, 0.4, 0.5}) under_test.insert(from_above(scene, x, 0.5, rng));
    ASSERT_EQ(under_test.surfaces().size(), 1U);
    const Surface& plate = *under_test.surfaces()[0];
    ASSERT_EQ(plate.polygons.size(), 1U);
    EXPECT_EQ(plate.polygons[0].holes.size(), half > 0.1 ? 1U : 0U);
    EXPECT_NEAR(plate.area_m2, half > 0.1 ? 0.8 - 0.09 : 0.8, 0.05);
  }
}

TEST(Mapper, GapsBelowHAreBridgedWiderOnesAreNot) {
  const double h = Parameters{}.max_hole_size();
  for (const double gap : {0.6 * h, 2 * h}) {
    std::mt19937_64 rng = test::rng();
    Scene scene;
    scene.rectangle({0, 0, 0.01}, {0.6, 0, 0}, {0, 1, 0})
        .rectangle({0.6 + gap, 0, 0.01}, {0.6, 0, 0}, {0, 1, 0});
    CheckedMapper under_test;
    for (int i = 0; i < 3; ++i) under_test.insert(from_above(scene, 0.6, 0.5, rng));
    EXPECT_EQ(under_test.surfaces().size(), gap < h ? 1U : 2U) << "gap " << gap;
  }
}

TEST(Mapper, StripsOfATiltingLaserMakeSurfaces) {
  std::mt19937_64 rng = test::rng();
  Scene scene;
  scene.rectangle({-1, -1.5, 0.01}, {3, 0, 0}, {0, 3, 0}).rectangle({2, -1.5, 0.01}, {0, 3, 0}, {0, 0, 1.5});
  CheckedMapper under_test;
  std::size_t first_surfaces = 0;
  for (int i = 0; i < 110; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(0, 0, 1);
    pose.rotate(Eigen::AngleAxisd(1.1 - 0.011 * i, Eigen::Vector3d::UnitY()));  // nods from the ground upward
    under_test.insert(test::laser_scan(scene, pose, rng));
    if (i == 0) first_surfaces = under_test.surfaces().size();
  }
  EXPECT_EQ(first_surfaces, 0U) << "no single scan shows a surface";
  const auto floor = under_test.on_plane(up, {1, 0, 0.01});
  const auto wall = under_test.on_plane({-1, 0, 0}, {2, 0, 0.7});
  ASSERT_EQ(floor.size(), 1U);
  ASSERT_EQ(wall.size(), 1U);
  EXPECT_GT(floor[0]->area_m2, 2);
  EXPECT_GT(wall[0]->area_m2, 1.5);
  EXPECT_EQ(under_test.surfaces().size(), 2U);
  test::expect_guarantees(under_test.mapper.map());
}

TEST(Mapper, RingsThatAStandingLidarRepeatsMakeNoTiltedSurfaces) {
  // With time noise spreads each ring's points along its rays, over several voxels: that is no width. On the
  // floor the rings are farther apart than h, and bend; at corners they break.
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<double> noise(0, 0.01);
  Scene room;
  room.box({-2.5, -2, 0}, {2.5, 2, 2.4}).box({0.8, 0.6, 0}, {1.8, 1.7, 0.72});
  room.box({-2.2, -1.8, 0}, {-1.2, -0.8, 0.2}).box({1.6, -1.2, 0}, {1.9, -0.9, 2.4});
  const Eigen::Vector3d eye(0.6, -0.1, 1.05);
  std::vector<Eigen::Vector3d> rays, seen;
  for (int ring = 0; ring < 16; ++ring)
    for (int step = 0; step < 180; ++step) {
      const double turn = step * std::numbers::pi / 90,
                   rise = (ring * 70.0 / 15 - 40) * std::numbers::pi / 180;
      rays.emplace_back(std::cos(rise) * std::cos(turn), std::cos(rise) * std::sin(turn), std::sin(rise));
      seen.emplace_back(*room.cast(eye, rays.back()) * rays.back());
    }
  CheckedMapper under_test(test::of_voxels(0.05));
  for (int i = 0; i < 150; ++i) {
    Scan scan;
    scan.T_map_sensor.translation() = eye;
    scan.stamp_s = 0.1 * i;
    for (std::size_t k = 0; k < rays.size(); ++k)
      scan.points.push_back((seen[k] + noise(rng) * rays[k]).cast<float>());
    under_test.insert(scan);
  }
  EXPECT_GE(under_test.surfaces().size(), 5U) << "the walls, where rings are near each other";
  for (const SurfacePtr& surface : under_test.surfaces())
    EXPECT_GT(surface->plane.normal.cwiseAbs().maxCoeff(), std::cos(10 * std::numbers::pi / 180))
        << "surface " << surface->id << ": " << surface->plane.normal.transpose();
}

/// Of the occupancy alone that scans leave, as a .bt has it.
TEST(Mapper, SurfacesOfAnOctreeWithoutScans) {
  std::mt19937_64 rng = test::rng();
  Parameters parameters;
  parameters.detection.min_surface_points = 1000000;  // nothing is detected while scanning
  Mapper blind(parameters);
  for (const Scan& scan : orbit(floor_with_box(), {0, 0, 0.2}, 1.0, 0.9, 8, rng)) blind.insert(scan);
  auto state = std::make_unique<surfaces::MapState>(Parameters{});
  state->occupancy = test::octree_of_file(test::bt_of(surfaces::state_of(blind.map()).occupancy));
  Mapper mapper(surfaces::map_of(std::move(state)));
  const ScanReport report = mapper.detect_in_occupancy();
  EXPECT_GT(report.appeared, 1000U);
  EXPECT_FALSE(report.born.empty());
  test::expect_guarantees(mapper.map());
  double floor = 0;
  for (const SurfacePtr& s : mapper.snapshot()->surfaces)
    if (s->plane.normal.z() > 0.99 && std::fabs(s->plane.offset - 0.01) < 0.02)
      floor = std::max(floor, s->area_m2);
  EXPECT_GT(floor, 2);
  // A surface level with the octree is off the centres of all its voxels by the same, anywhere within d/2.
  const double d = mapper.map().parameters().occupancy.resolution;
  EXPECT_NEAR(surfaces::state_of(mapper.map()).noise.surface_variance(), d * d / 12, 1e-12);
}

/// A .bt in which a box is gone and the floor goes on, as from another tool, tilted against the octree.
TEST(Mapper, SurfacesStayAndGrowOnAnotherOctree) {
  std::mt19937_64 rng = test::rng();
  Scene small, large;
  const Eigen::Vector3d along(1, 0, 0.07), across(0, 1, 0.03);
  const auto on_floor = [&](double x, double y) -> Eigen::Vector3d { return x * along + y * across; };
  small.rectangle(on_floor(-0.9, -0.9), 1.8 * along, 1.8 * across);
  small.box({0.3, -0.25, 0}, {0.6, 0.25, 0.4});
  large.rectangle(on_floor(-0.9, -0.9), 3 * along, 1.8 * across);
  Mapper mapper, other;
  for (const Scan& scan : orbit(small, {0, 0, 0.2}, 1.0, 0.9, 8, rng)) mapper.insert(scan);
  for (const Scan& scan : orbit(large, {0, 0, 0.2}, 1.0, 0.9, 8, rng)) other.insert(scan);
  for (const Scan& scan : orbit(large, {1.3, 0, 0.2}, 1.0, 0.9, 8, rng)) other.insert(scan);
  const auto floor_of = [](const Mapper& of) {
    return *std::ranges::max_element(of.snapshot()->surfaces, {},
                                     [](const SurfacePtr& s) { return s->area_m2; });
  };
  const SurfacePtr before = floor_of(mapper);
  auto state = std::make_unique<surfaces::MapState>(Parameters{});
  state->occupancy = test::octree_of_file(test::bt_of(surfaces::state_of(other.map()).occupancy));
  const Map octree = surfaces::map_of(std::move(state));
  const ScanReport report = mapper.replace_occupancy(octree);
  EXPECT_GT(report.appeared, 1000U);
  EXPECT_FALSE(report.gone.empty()) << "the box's";
  test::expect_guarantees(mapper.map());
  EXPECT_EQ(test::bt_of(surfaces::state_of(mapper.map()).occupancy),
            test::bt_of(surfaces::state_of(octree).occupancy));
  const SurfacePtr after = floor_of(mapper);
  EXPECT_EQ(after->id, before->id);
  EXPECT_GT(after->area_m2, 0.95 * floor_of(other)->area_m2);
  EXPECT_LT(std::acos(after->plane.normal.dot(along.cross(across).normalized())),
            0.5 * std::numbers::pi / 180);

  const std::shared_ptr<const Snapshot> once = mapper.snapshot();
  EXPECT_EQ(mapper.replace_occupancy(octree).appeared, 0U);
  EXPECT_EQ(mapper.snapshot()->surfaces.size(), once->surfaces.size());
  EXPECT_THROW(mapper.replace_occupancy(Mapper(test::of_voxels(0.03)).map()), Error);
}

}  // namespace
}  // namespace octosurf::mapper
