// Whole scans through the whole way, on scenes whose surfaces are known.
#include "occupancy/octree_bytes.hpp"
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/room_tour.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/map_state.hpp"

#include <octosurf/space_part.hpp>
#include <octosurf/up.hpp>

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

// Snapshots while the map goes on: what mapper.hpp promises to readers in other threads.

/// What is wrong with a snapshot; empty if it is whole.
std::string fault_of(const Snapshot& snapshot) {
  std::map<SurfaceId, std::size_t> inliers;  // a voxel more or less, and the octree is of another scan
  constexpr double all = std::numeric_limits<double>::infinity();
  snapshot.octree.for_each_occupied({Eigen::Vector3d::Constant(-all), Eigen::Vector3d::Constant(all)},
                                    [&](const OccupancyView::Voxel& voxel) {
                                      ++inliers[voxel.surface];
                                      return true;
                                    });
  inliers.erase(0);
  SurfaceId last = 0;
  for (const SurfacePtr& s : snapshot.surfaces) {
    const bool whole =
        s->id > last && s->revision <= snapshot.revision && s->inliers > 0 && s->inliers == inliers[s->id] &&
        snapshot.find(s->id) == s.get() && s->boundary.size() == test::count_vertices(s->polygons) &&
        std::fabs(test::area(s->polygons) - s->area_m2) < 1e-6 && test::invalid(s->polygons).empty();
    if (!whole) return "surface " + std::to_string(s->id);
    last = s->id;
  }
  return inliers.size() == snapshot.surfaces.size() ? "" : "a surface is in the octree only";
}

TEST(Readers, FourAtFullSpeedSeeWholeSnapshotsOnly) {
  const std::vector<Scan> scans = test::room_tour(test::rng(), 16);
  Mapper mapper(Parameters{}, 2);
  mapper.share_octree();
  std::atomic<bool> done{false};
  std::array<std::string, 4> wrong;
  std::array<std::uint64_t, 4> revision{};
  std::vector<std::jthread> threads;
  for (std::size_t i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (bool last = false; !last;) {
        last = done;
        const std::shared_ptr<const Snapshot> snapshot = mapper.snapshot();
        if (snapshot->revision < revision[i]) wrong[i] += " went back";
        revision[i] = snapshot->revision;
        wrong[i] += fault_of(*snapshot);
      }
    });
  for (const Scan& scan : scans) mapper.insert(scan);
  done = true;
  threads.clear();  // joins
  EXPECT_THAT(wrong, ::testing::Each(""));
  EXPECT_THAT(revision, ::testing::Each(scans.size())) << "what was inserted is seen at once";
}

// Up, found from a map that was made from scans.

using Eigen::Vector3d;

double angle(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// A narrow passage: 3.6 m² of wall on each side of 1.4 m² of floor, and a step.
test::Scene passage() {
  test::Scene scene;
  scene.rectangle({-1, -0.35, 0}, {2, 0, 0}, {0, 0.7, 0});
  scene.rectangle({-1, -0.35, 0}, {2, 0, 0}, {0, 0, 1.8}).rectangle({-1, 0.35, 0}, {2, 0, 0}, {0, 0, 1.8});
  scene.box({0.5, -0.34, 0}, {0.98, 0.34, 0.2});
  return scene;
}

std::vector<Scan> walk(std::mt19937_64& rng) {
  std::vector<Scan> scans;
  test::Camera camera;
  camera.width = 120;
  camera.height = 160;
  camera.focal = 90;
  const test::Scene scene = passage();
  for (const double x : {-0.9, -0.6, -0.3})
    for (const double aside : {-0.5, 0.0, 0.5})
      scans.push_back(
          test::camera_scan(scene, test::look_at({x, 0, 1.2}, {x + 1, aside, 0.55}), rng, camera));
  return scans;
}

Parameters estimating() {
  Parameters parameters;
  parameters.up.reset();
  return parameters;
}

TEST(UpOfAMap, IsFoundHoweverItsFrameIsTurned) {
  std::mt19937_64 rng(test::seed());
  std::normal_distribution<double> gauss;
  const std::vector<Scan> scans = walk(rng);
  for (int world = 0; world < 3; ++world) {
    const Eigen::Isometry3d R(
        Eigen::Quaterniond(gauss(rng), gauss(rng), gauss(rng), gauss(rng)).normalized());
    Mapper mapper(estimating());
    for (const Scan& scan : scans) mapper.insert(test::moved(scan, R));
    const Up of_all = up_of(mapper.map());
    EXPECT_EQ(of_all.source, Up::Source::surfaces);
    EXPECT_LT(angle(of_all.direction, R.linear().col(2)), 0.5 * test::degree);
    const Up alone = estimate_up(*mapper.snapshot());
    EXPECT_GT(angle(alone.direction, R.linear().col(2)), 80 * test::degree)
        << "without the camera it is a wall";
  }
}

TEST(UpOfAMap, LidarsStandOnTheirZ) {
  Mapper mapper(estimating());
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.T_map_sensor = Eigen::Isometry3d(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()));
  for (double u = -1; u <= 1; u += 0.015)
    for (double v = -1; v <= 1; v += 0.015) {
      scan.points.push_back(Eigen::Vector3d(u, v, -1).cast<float>());         // the floor, below the sensor
      scan.points.push_back(Eigen::Vector3d(u, 1.5, 1.5 * v).cast<float>());  // a larger wall
    }
  mapper.insert(scan);
  EXPECT_LT(angle(up_of(mapper.map()).direction, -Vector3d::UnitY()), 0.1 * test::degree);
}

TEST(UpOfAMap, ChangesNothingElse) {
  std::mt19937_64 rng(test::seed());
  const std::vector<Scan> scans = walk(rng);
  Parameters sideways;
  sideways.up = Vector3d::UnitX();
  const Mapper one = test::mapped(scans), other = test::mapped(scans, sideways);
  EXPECT_TRUE(test::leaves_of(one.map()) == test::leaves_of(other.map()));
  const std::vector<SurfacePtr> of_one = one.snapshot()->surfaces, of_other = other.snapshot()->surfaces;
  ASSERT_EQ(of_one.size(), of_other.size());
  for (std::size_t i = 0; i < of_one.size(); ++i)
    EXPECT_TRUE(test::identical(of_one[i]->polygons, of_other[i]->polygons)) << i;
}

// What is taken back from a map, and comes back where it is.

using State = OccupancyView::State;

const Eigen::AlignedBox3d chest(Eigen::Vector3d(-0.2, -0.15, 0.011), Eigen::Vector3d(0.2, 0.15, 0.311));

Scene floor_of_room() {
  Scene scene;
  scene.rectangle({-1.2, -1.2, 0.011}, {2.4, 0, 0}, {0, 2.4, 0});
  return scene;
}
Scene with_chest() {
  Scene scene = floor_of_room();
  scene.box(chest.min(), chest.max());
  return scene;
}
void look(CheckedMapper& mapper, const Scene& scene, int count, std::mt19937_64& rng) {
  for (const Scan& scan : test::orbit(scene, {0, 0, 0.1}, 1.1, 1.3, count, rng, {320, 240, 260}))
    mapper.insert(scan);
}
std::size_t tops(const CheckedMapper& mapper) {
  return mapper.on_plane({0, 0, 1}, {0, 0, chest.max().z()}).size();
}

TEST(Clear, WhatIsInsideGoesAndComesBackOnlyIfItIsThere) {
  for (const bool stays : {false, true}) {
    SCOPED_TRACE(stays ? "it stays" : "it is carried out");
    std::mt19937_64 rng = test::rng();
    CheckedMapper mapper(test::of_voxels(0.02));
    look(mapper, with_chest(), 10, rng);
    ASSERT_EQ(tops(mapper), 1U);
    const auto before = mapper.mapper.snapshot();
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.05);
    const ScanReport report =
        mapper.mapper.clear(SpacePart::box({chest.min() - margin, chest.max() + margin}));
    test::expect_guarantees(mapper.mapper.map());
    EXPECT_GT(report.vanished, 500U);
    EXPECT_GE(report.gone.size(), 5U);  // top and sides
    EXPECT_EQ(tops(mapper), 0U);
    EXPECT_GT(mapper.mapper.snapshot()->revision, before->revision);
    EXPECT_EQ(mapper.mapper.map().octree().at({0, 0, chest.max().z()}).state, State::unknown);
    look(mapper, stays ? with_chest() : floor_of_room(), 2, rng);
    EXPECT_EQ(tops(mapper), stays ? 1U : 0U);
  }
}

TEST(Clear, IsByTheMiddlesOfVoxels) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> any(-1, 1);
  for (const bool as_free : {false, true})
    for (const bool round : {false, true}) {
      SCOPED_TRACE(testing::Message() << (as_free ? "free" : "unknown") << (round ? ", round" : ""));
      CheckedMapper mapper(test::of_voxels(0.02));
      look(mapper, with_chest(), 4, rng);
      SpacePart part;
      part.T_map_part.linear() =
          Eigen::Quaterniond(any(rng), any(rng), any(rng), any(rng)).normalized().toRotationMatrix();
      part.T_map_part.translation() << any(rng) / 4, any(rng) / 4, any(rng) / 4;
      part.half_size << 0.3, round ? 0.3 : 0.1, 0.2;
      part.round = round;
      const OccupancyView before = mapper.mapper.map().octree();
      mapper.mapper.clear(part, as_free);
      const OccupancyView after = mapper.mapper.map().octree();
      std::size_t inside = 0;
      for (int i = 0; i < 200000; ++i) {
        const Eigen::Vector3d p(any(rng), any(rng), any(rng));
        const OccupancyView::Voxel was = before.at(p), is = after.at(p);
        const Eigen::Vector3d q = part.T_map_part.inverse() * was.center;
        const bool in = round ? q.head<2>().norm() <= 0.3 && std::abs(q.z()) <= 0.2
                              : (q.cwiseAbs().array() <= part.half_size.array()).all();
        if (!in) {
          ASSERT_EQ(was.log_odds, is.log_odds) << p.transpose();
          ASSERT_EQ(was.state, is.state);
        } else if (was.state == State::unknown || !as_free) {
          ASSERT_EQ(is.state, State::unknown) << p.transpose();
        } else {
          ASSERT_EQ(is.state, State::free) << p.transpose();
          ++inside;
        }
      }
      EXPECT_EQ(inside > 100, as_free);
      test::expect_guarantees(mapper.mapper.map());
    }
}

TEST(Clear, RefusesPartsThatAreNone) {
  CheckedMapper mapper(test::of_voxels(0.02));
  EXPECT_THROW(mapper.mapper.clear(SpacePart()), Error);
  SpacePart endless = SpacePart::cylinder({0, 0, 0}, 1, 1);
  endless.half_size.z() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(mapper.mapper.clear(endless), Error);
}

}  // namespace
}  // namespace octosurf::mapper
