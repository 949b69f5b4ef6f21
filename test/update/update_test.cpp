#include "support/map_state.hpp"
#include "surfaces/blobs.hpp"
#include "update/retract.hpp"

namespace octosurf::update {
namespace {

const Plane ground{Eigen::Vector3d::UnitZ(), 0.01};

/// A floor 1 m × 1 m at z = 0.01, in the octree, all of it pending.
struct Floor {
  void give_to_surface() {
    surfaces::Ledger ledger(state);
    test::make_surface(ledger, delta.appeared, ground, [](const Eigen::Vector3d&) { return true; });
  }

  surfaces::MapState state{Parameters{}};
  occupancy::OccupancyDelta delta =
      test::occupy(state, test::rectangle_scan({0.5, 0.5, 1.5}, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0}));
};

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

TEST(Retract, DissolvesBelowTheFewestPoints) {
  Floor floor;
  const auto n = static_cast<std::size_t>(floor.state.parameters.min_surface_points());
  floor.give_to_surface();
  const std::size_t all = floor.state.surfaces.find(1)->size();
  const occupancy::OccupancyDelta delta =
      vanish(floor.state, {floor.delta.appeared.begin() + 20, floor.delta.appeared.end()});
  const std::size_t left_over = all - delta.vanished.size();
  ASSERT_LT(left_over, n);
  surfaces::Ledger ledger(floor.state);
  retract(ledger, delta);
  EXPECT_EQ(floor.state.surfaces.find(1), nullptr);
  EXPECT_TRUE(ledger.changes.gone.contains(1));
  EXPECT_EQ(ledger.changes.unprocessed.size(), left_over) << "its points return to pending";
  floor.state.occupancy.for_each_point([](const occupancy::VoxelPoint& p) { EXPECT_EQ(p.surface, 0U); });
  EXPECT_TRUE(floor.state.surfaces.near(floor.delta.appeared.front().key, 500).empty());
}

TEST(Retract, CarriesRefinedPointsOver) {
  Floor floor;
  floor.give_to_surface();
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

}  // namespace
}  // namespace octosurf::update
