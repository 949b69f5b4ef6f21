#include "support/map_state.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/criteria/joining.hpp"
#include "surfaces/criteria/soundness.hpp"
#include "upkeep/derive.hpp"
#include "upkeep/retract.hpp"
#include "upkeep/revise.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::upkeep {
namespace {

const Plane ground{Eigen::Vector3d::UnitZ(), 0.01};

/// A floor 1 m × 1 m at z = 0.01, in the octree, all of it pending.
struct Floor {
  surfaces::MapState state{Parameters{}};
  occupancy::OccupancyDelta delta =
      test::occupy(state, test::rectangle_scan({0.5, 0.5, 1.5}, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}));
};

bool everywhere(const Eigen::Vector3d&) { return true; }
bool left(const Eigen::Vector3d& p) { return p.x() < 0.5; }
bool right(const Eigen::Vector3d& p) { return p.x() >= 0.5; }

/// Octree and surfaces say the same.
void expect_in_step(const surfaces::MapState& state) {
  std::size_t owned = 0, inliers = 0;
  state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    if (p.surface == 0) return;
    ++owned;
    EXPECT_NE(state.surfaces.find(p.surface), nullptr);
  });
  for (const auto& [id, surface] : state.surfaces) inliers += surface.size();
  EXPECT_EQ(owned, inliers);
}

/// As if rays had removed these voxels: out of the octree's books, then retract().
occupancy::OccupancyDelta vanish(surfaces::MapState& state,
                                 const std::vector<occupancy::VoxelPoint>& points) {
  // Look from above through the floor into a pit, often enough to empty every voxel.
  occupancy::OccupancyDelta all;
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d(0.5, 0.5, 1.5);
  for (const occupancy::VoxelPoint& p : points) {
    const Eigen::Vector3d v = p.position.cast<double>() - scan.T_map_sensor.translation();
    scan.points.push_back((v * 1.4).cast<float>());
  }
  for (int i = 0; i < 12; ++i) {
    occupancy::OccupancyDelta delta = test::occupy(state, scan);
    all.vanished.insert(all.vanished.end(), delta.vanished.begin(), delta.vanished.end());
  }
  return all;
}

TEST(Retract, TakesVanishedVoxelsOut) {
  Floor floor;
  {
    surfaces::Ledger ledger(floor.state);
    test::make_surface(ledger, floor.delta.appeared, ground, everywhere);
  }
  std::vector<occupancy::VoxelPoint> part(floor.delta.appeared.begin(), floor.delta.appeared.begin() + 300);
  const occupancy::OccupancyDelta delta = vanish(floor.state, part);
  ASSERT_GT(delta.vanished.size(), 200U);
  surfaces::Ledger ledger(floor.state);
  const std::size_t before = floor.state.surfaces.find(1)->size();
  retract(ledger, delta);
  EXPECT_EQ(floor.state.surfaces.find(1)->size(), before - delta.vanished.size());
  EXPECT_TRUE(ledger.changes.shrunk.contains(1));
  EXPECT_FALSE(ledger.changes.gone.contains(1));
  expect_in_step(floor.state);
}

TEST(Retract, DissolvesBelowTheFewestPoints) {
  Floor floor;
  const auto n = static_cast<std::size_t>(floor.state.parameters.min_surface_points());
  {
    surfaces::Ledger ledger(floor.state);
    test::make_surface(ledger, floor.delta.appeared, ground, everywhere);
  }
  const std::size_t all = floor.state.surfaces.find(1)->size();
  const occupancy::OccupancyDelta delta =
      vanish(floor.state, {floor.delta.appeared.begin() + 20, floor.delta.appeared.end()});
  const std::size_t left_over = all - delta.vanished.size();
  ASSERT_LT(left_over, n);
  surfaces::Ledger ledger(floor.state);
  retract(ledger, delta);
  EXPECT_EQ(floor.state.surfaces.find(1), nullptr);
  EXPECT_TRUE(ledger.changes.gone.contains(1));
  EXPECT_EQ(ledger.changes.requeued.size(), left_over) << "its points return to pending";
  floor.state.occupancy.for_each_point([](const occupancy::VoxelPoint& p) { EXPECT_EQ(p.surface, 0U); });
  EXPECT_TRUE(floor.state.surfaces.near(floor.delta.appeared.front().key, 500).empty());
}

TEST(Retract, CarriesRefinedPointsOver) {
  Floor floor;
  {
    surfaces::Ledger ledger(floor.state);
    test::make_surface(ledger, floor.delta.appeared, ground, everywhere);
  }
  // The same floor from 0.4 m: nearer views replace the points, 3 mm higher.
  const occupancy::OccupancyDelta delta = test::occupy(
      floor.state, test::rectangle_scan({0.5, 0.5, 0.4}, {0.3, 0.3, 0.013}, {0.4, 0, 0}, {0, 0.4, 0}));
  ASSERT_GT(delta.refined.size(), 100U);
  surfaces::Ledger ledger(floor.state);
  retract(ledger, delta);
  expect_in_step(floor.state);
  const surfaces::SurfaceModel& surface = *floor.state.surfaces.find(1);
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    EXPECT_EQ(floor.state.occupancy.at(inlier.key).point->position, inlier.position);
}

TEST(Refit, RecoversThePlane) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 5; ++round) {
    Floor floor;
    Plane wrong = ground;
    wrong.normal = (wrong.normal + 0.01 * Eigen::Vector3d(uniform(rng), uniform(rng), 0)).normalized();
    wrong.offset = wrong.normal.dot(Eigen::Vector3d(0.5, 0.5, 0.01)) + 0.003 * uniform(rng);
    surfaces::Ledger ledger(floor.state);
    const surfaces::SurfaceModel& surface =
        test::make_surface(ledger, floor.delta.appeared, wrong, everywhere);
    const std::size_t before = surface.size();
    refit(ledger);
    ASSERT_NE(floor.state.surfaces.find(1), nullptr);
    EXPECT_EQ(surface.size(), before);
    EXPECT_GT(surface.plane().normal.z(), 0) << "the normal stays on its side";
    EXPECT_LT(std::acos(std::min(1.0, surface.plane().normal.z())), 0.001);
    EXPECT_NEAR(surface.plane().signed_distance({0.5, 0.5, 0.01}), 0, 2e-4);
    expect_in_step(floor.state);
  }
}

TEST(Refit, ReturnsWhatAMovedPlaneLeavesBehind) {
  // A few points of a step 4 cm higher were taken in: the plane of the many leaves them.
  Floor floor;
  const occupancy::OccupancyDelta step = test::occupy(
      floor.state, test::rectangle_scan({0.5, 0.5, 1.5}, {0.2, 0.2, 0.05}, {0.15, 0, 0}, {0, 0.15, 0}));
  std::vector<occupancy::VoxelPoint> points = floor.delta.appeared;
  points.insert(points.end(), step.appeared.begin(), step.appeared.end());
  surfaces::Ledger ledger(floor.state);
  const Plane between{Eigen::Vector3d::UnitZ(), 0.03};
  const surfaces::SurfaceModel& surface = test::make_surface(ledger, points, between, everywhere);
  refit(ledger);
  EXPECT_NEAR(surface.plane().offset, 0.01, 0.005);
  EXPECT_GE(ledger.changes.requeued.size(), step.appeared.size() * 9 / 10);
  expect_in_step(floor.state);
}

TEST(Refit, GivesBothPartsOfWhatItSplitsTheirOwnPlanes) {
  // Two tops that lean 4 degrees against one another, 4 cm apart, were one surface.
  const double lean = 4 * std::numbers::pi / 180;
  const Eigen::Vector3d eye(0.5, 0.2, 1.5), y(0, 0.4, 0);
  const Eigen::Vector3d along(std::cos(lean), 0, std::sin(lean)), normal(-along.z(), 0, along.x());
  surfaces::MapState state{Parameters{}};
  auto points = test::occupy(state, test::rectangle_scan(eye, {0, 0, 0.01}, {0.5, 0, 0}, y)).appeared;
  const auto second =
      test::occupy(state, test::rectangle_scan(eye, {0.54, 0, 0.01}, 0.4 * along, y)).appeared;
  points.insert(points.end(), second.begin(), second.end());
  surfaces::Ledger ledger(state);
  surfaces::SurfaceModel& surface =
      test::make_surface(ledger, points, {Eigen::Vector3d::UnitZ(), 0.015}, everywhere);
  std::vector<occupancy::PointWindow::Index> all;
  for (const occupancy::VoxelPoint& p : points) all.push_back(ledger.window.find(p.key));
  surface.set_plane(surfaces::fitted(ledger, all, surface.plane()));
  surface.checked_plane = surface.plane();
  refit(ledger);
  ASSERT_EQ(state.surfaces.size(), 2U);
  EXPECT_LT((state.surfaces.find(1)->plane().normal - Eigen::Vector3d::UnitZ()).norm(), 0.0087)
      << "half a degree";
  EXPECT_LT((state.surfaces.find(2)->plane().normal - normal).norm(), 0.0087);
  expect_in_step(state);
}

Reason dissolved(const surfaces::Ledger& ledger, SurfaceId id) {
  EXPECT_TRUE(ledger.changes.gone.contains(id));
  EXPECT_EQ(ledger.surfaces.find(id), nullptr);
  return ledger.changes.unsound.at(id).reason;
}

TEST(Refit, TellsWhyItDissolvesWhatIsTooNarrow) {
  Floor floor;
  surfaces::Ledger ledger(floor.state);
  test::make_surface(ledger, floor.delta.appeared, ground,
                     [](const Eigen::Vector3d& p) { return p.y() > 0.5 && p.y() < 0.52; });
  refit(ledger);
  ASSERT_EQ(dissolved(ledger, 1), Reason::too_narrow);
  EXPECT_LE(ledger.changes.unsound.at(1).measured, 0.02);
  EXPECT_DOUBLE_EQ(ledger.changes.unsound.at(1).limit, 0.8 * Parameters{}.surfaces.min_surface_width);
  expect_in_step(floor.state);
}

TEST(Refit, DissolvesWhatIsNarrowWhereverItIs) {
  // What is left of a floor half a metre wide: two rows of voxels of every thirty, both ways.
  Parameters parameters;
  parameters.occupancy.resolution = 0.01;
  surfaces::MapState state(parameters);
  const auto appeared = test::occupy(state, test::rectangle_scan({0.3, 0.3, 1.5}, {0.0025, 0.0025, 0.015},
                                                                 {0.6, 0, 0}, {0, 0.6, 0}, 0.005))
                            .appeared;
  surfaces::Ledger ledger(state);
  const auto on_bar = [](double x) { return std::fmod(x, 0.3) < 0.02; };
  test::make_surface(ledger, appeared, {Eigen::Vector3d::UnitZ(), 0.015},
                     [&](const Eigen::Vector3d& p) { return on_bar(p.x()) || on_bar(p.y()); });
  refit(ledger);
  ASSERT_EQ(dissolved(ledger, 1), Reason::too_narrow);
  EXPECT_NEAR(ledger.changes.unsound.at(1).measured, 0.02, 0.002);
  expect_in_step(state);
}

TEST(Refit, TellsWhyItDissolvesWhatBends) {
  surfaces::MapState state{Parameters{}};
  Scan pillar;  // of radius 0.25 m
  pillar.T_map_sensor.translation() = Eigen::Vector3d(1.5, 0, 0.5);
  for (double z = 0; z < 1; z += 0.009)
    for (double a = -0.6; a < 0.6; a += 0.03)
      pillar.points.push_back(
          (Eigen::Vector3d(0.25 * std::cos(a), 0.25 * std::sin(a), z) - pillar.T_map_sensor.translation())
              .cast<float>());
  const occupancy::OccupancyDelta delta = test::occupy(state, pillar);
  surfaces::Ledger ledger(state);
  test::make_surface(ledger, delta.appeared, {Eigen::Vector3d::UnitX(), 0.235}, everywhere);
  refit(ledger);
  EXPECT_EQ(dissolved(ledger, 1), Reason::bent);
}

TEST(Refit, TellsWhoseNoiseWhatItDissolvesIs) {
  // A patch in front of a floor by more than s, but less than 1.3 s, that was there first.
  Floor floor;
  const double s = Parameters{}.surface_tolerance();
  const occupancy::OccupancyDelta sheet = test::occupy(
      floor.state,
      test::rectangle_scan({0.5, 0.5, 1.5}, {0.2, 0.2, 0.01 + 1.15 * s}, {0.5, 0, 0}, {0, 0.5, 0}));
  surfaces::Ledger ledger(floor.state);
  test::make_surface(ledger, sheet.appeared, {Eigen::Vector3d::UnitZ(), 0.01 + 1.15 * s}, everywhere);
  const surfaces::SurfaceModel& real = test::make_surface(ledger, floor.delta.appeared, ground, everywhere);
  refit(ledger);
  ASSERT_EQ(dissolved(ledger, 1), Reason::noise_sheet);
  EXPECT_EQ(ledger.changes.unsound.at(1).surface, real.id());
  EXPECT_EQ(ledger.changes.unsound.size(), 1U) << "the floor stays";
}

TEST(Refit, TellsHowFewItLeaves) {
  Floor floor;
  surfaces::Ledger ledger(floor.state);
  surfaces::SurfaceModel& surface = test::make_surface(
      ledger, floor.delta.appeared, ground,
      [](const Eigen::Vector3d& p) { return p.x() > 0.4 && p.x() < 0.6 && p.y() > 0.4 && p.y() < 0.6; });
  const std::vector<surfaces::Inlier> inliers = surface.sorted_inliers();
  for (std::size_t i = 30; i < inliers.size(); ++i) ledger.requeue(ledger.window.find(inliers[i].key));
  refit(ledger);
  ASSERT_EQ(dissolved(ledger, 1), Reason::too_few_points);
  EXPECT_EQ(ledger.changes.unsound.at(1).measured, 30);
  EXPECT_EQ(ledger.changes.unsound.at(1).limit, 50);
}

TEST(Merge, KeepsPointsAndLineage) {
  Floor floor;
  surfaces::Ledger ledger(floor.state);
  surfaces::SurfaceModel& a = test::make_surface(ledger, floor.delta.appeared, ground, left);
  surfaces::SurfaceModel& b = test::make_surface(ledger, floor.delta.appeared, ground, right);
  const std::size_t together = a.size() + b.size();
  const geometry::Moments ma = a.moments(nullptr),
                          mb = b.moments(nullptr).shifted(a.reference() - b.reference());
  ASSERT_TRUE(surfaces::coplanar(a, b, (a.reference() + b.reference()) / 2, floor.state.noise));
  ledger.merge(a, b);
  EXPECT_EQ(a.size(), together);
  EXPECT_EQ(floor.state.surfaces.find(2), nullptr);
  EXPECT_EQ(a.parents(), std::vector<SurfaceId>{2});
  EXPECT_TRUE(ledger.changes.merged.contains(2));
  EXPECT_FALSE(ledger.changes.touched().contains(2));
  EXPECT_TRUE(ledger.changes.touched().contains(1));
  EXPECT_LT((a.moments(nullptr).outer - ma.outer - mb.outer).norm(), 1e-9);
  floor.state.occupancy.for_each_point([](const occupancy::VoxelPoint& p) { EXPECT_EQ(p.surface, 1U); });
  expect_in_step(floor.state);
}

/// Two patches side by side, the second raised and tilted.
bool are_coplanar(double raised, double tilt) {
  surfaces::MapState state{Parameters{}};
  const auto points = [&](const Scan& scan) { return test::occupy(state, scan).appeared; };
  const Eigen::Vector3d eye(0.5, 0.25, 1.5);
  const auto first = points(test::rectangle_scan(eye, {0, 0, 0.01}, {0.5, 0, 0}, {0, 0.5, 0}));
  const Eigen::Vector3d along(std::cos(tilt), 0, std::sin(tilt));
  const auto second = points(test::rectangle_scan(eye, {0.53, 0, 0.01 + raised}, 0.5 * along, {0, 0.5, 0}));
  surfaces::Ledger ledger(state);
  surfaces::SurfaceModel& a = test::make_surface(ledger, first, ground, everywhere);
  const Eigen::Vector3d n = along.cross(Eigen::Vector3d::UnitY());
  surfaces::SurfaceModel& b =
      test::make_surface(ledger, second, {n, n.dot(Eigen::Vector3d(0.53, 0, 0.01 + raised))}, everywhere);
  const Eigen::Vector3d contact(0.515, 0.25, 0.01);
  const bool one_way = surfaces::coplanar(a, b, contact, state.noise),
             other_way = surfaces::coplanar(b, a, contact, state.noise);
  EXPECT_EQ(one_way, other_way);
  return one_way;
}

TEST(Coplanar, OnePlaneAndOneOnly) {
  EXPECT_TRUE(are_coplanar(0, 0));
  EXPECT_TRUE(are_coplanar(0.003, 0)) << "less than the noise";
  EXPECT_FALSE(are_coplanar(0.05, 0)) << "a step";
  EXPECT_FALSE(are_coplanar(0, 0.3)) << "a ramp of 17 degrees";
  EXPECT_FALSE(are_coplanar(0, 1.5)) << "a wall";
}

TEST(Derive, PublishesWhatChangedAndKeepsTheRest) {
  Floor floor;
  {
    surfaces::Ledger ledger(floor.state);
    test::make_surface(ledger, floor.delta.appeared, ground, left);
    test::make_surface(ledger, floor.delta.appeared, ground, right);
    floor.state.snapshot.store(derive(floor.state, ledger.changes));
  }
  const auto first = floor.state.snapshot.load();
  ASSERT_EQ(first->surfaces.size(), 2U);
  EXPECT_EQ(first->revision, 1U);
  EXPECT_NEAR(first->surfaces[0]->area_m2, 0.5, 0.03);
  surfaces::Ledger ledger(floor.state);
  ledger.requeue(ledger.window.find(floor.state.surfaces.find(2)->sorted_inliers().front().key));
  floor.state.snapshot.store(derive(floor.state, ledger.changes));
  const auto second = floor.state.snapshot.load();
  EXPECT_EQ(second->revision, 2U);
  EXPECT_EQ(second->surfaces[0], first->surfaces[0]) << "not copied";
  EXPECT_NE(second->surfaces[1], first->surfaces[1]);
  EXPECT_EQ(second->changed_since(1).size(), 1U);
  EXPECT_EQ(second->find(2)->revision, 2U);
  EXPECT_EQ(first->find(2)->inliers, second->find(2)->inliers + 1) << "what was published never changes";
  EXPECT_EQ(second->find(3), nullptr);
}

}  // namespace
}  // namespace octosurf::upkeep
