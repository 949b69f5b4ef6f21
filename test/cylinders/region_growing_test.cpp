// Region growing by itself: regions that follow from the geometry, and a slow twin.
#include "cylinders/region_growing.hpp"

#include "support/pending_points.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <gmock/gmock.h>
#include <map>
#include <optional>
#include <random>

namespace octosurf::cylinders {
namespace {

using test::PendingPoints;
using test::rectangle_scan;
using Regions = std::vector<std::vector<PointId>>;

constexpr double degree = std::numbers::pi / 180;
const Eigen::Vector3d eye(0.5, 0.5, 2);

Regions grown(PendingPoints& pending) {
  RegionGrowing grow(pending.ledger, pending.state.parameters);
  return grow(pending.all, [](PointId) { return true; });
}

/// Two halves of a floor that meet at y = 0.5 under `angle`.
std::vector<Scan> folded(double angle) {
  return {rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 0.5, 0}),
          rectangle_scan(eye, {0, 0.5, 0.01}, {1, 0, 0}, {0, 0.5 * std::cos(angle), 0.5 * std::sin(angle)})};
}

TEST(RegionGrowing, APlaneIsOneRegion) {
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0})});
  const Regions regions = grown(pending);
  ASSERT_EQ(regions.size(), 1U);
  EXPECT_THAT(regions[0], ::testing::UnorderedElementsAreArray(pending.all));
}

TEST(RegionGrowing, FollowsAGentleBendAndNotASharpOne) {
  // Where two halves meet, a normal is smoothed over its neighbourhood: a fold of 10° turns from point to
  // point by less than the smoothness angle of 30°, and is flat enough to go on from; one of 80° has an edge
  // that is not flat. The edge itself joins either side, but nothing goes on from it.
  PendingPoints gentle(folded(10 * degree));
  EXPECT_EQ(grown(gentle).size(), 1U);
  PendingPoints sharp(folded(80 * degree));
  const Regions regions = grown(sharp);
  ASSERT_EQ(regions.size(), 2U);
  const double edge = 0.05;
  for (const std::vector<PointId>& region : regions) {
    std::size_t low = 0, high = 0;
    for (const PointId i : region) {
      low += sharp.position(i).y() < 0.5 - edge;
      high += sharp.position(i).z() > 0.01 + edge;
    }
    EXPECT_TRUE(low == 0 || high == 0) << low << " and " << high;
    EXPECT_GT(low + high, region.size() * 8 / 10);
  }
}

TEST(RegionGrowing, ComparesWithThePointItComesFrom) {
  // A vault of radius 1 m over 80°: far more than the smoothness angle from end to end, 1° a voxel.
  Scan vault;
  vault.T_map_sensor.translation() = Eigen::Vector3d(0.5, 0, -0.5);
  for (double x = 0; x < 1; x += 0.009)
    for (double a = -40 * degree; a < 40 * degree; a += 0.009)
      vault.points.push_back(
          (Eigen::Vector3d(x, std::sin(a), std::cos(a)) - vault.T_map_sensor.translation()).cast<float>());
  PendingPoints pending({vault});
  const Regions regions = grown(pending);
  ASSERT_EQ(regions.size(), 1U);
  EXPECT_GE(regions[0].size(), pending.all.size() * 99 / 100);
}

TEST(RegionGrowing, StopsAtAGap) {
  // A point reaches as far as the neighbourhood of its normal, some voxels; never over 0.2 m.
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {0.4, 0, 0}, {0, 1, 0}),
                         rectangle_scan(eye, {0.6, 0, 0.01}, {0.4, 0, 0}, {0, 1, 0})});
  const Regions regions = grown(pending);
  ASSERT_EQ(regions.size(), 2U);
  EXPECT_EQ(regions[0].size() + regions[1].size(), pending.all.size());
}

TEST(RegionGrowing, GoesWhereItIsAllowed) {
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0})});
  const auto allowed = [&](PointId i) { return std::fabs(pending.position(i).x() - 0.5) > 0.1; };
  RegionGrowing grow(pending.ledger, pending.state.parameters);
  const Regions regions = grow(pending.all, allowed);
  ASSERT_EQ(regions.size(), 2U);
  const auto wanted = std::count_if(pending.all.begin(), pending.all.end(), allowed);
  EXPECT_EQ(regions[0].size() + regions[1].size(), static_cast<std::size_t>(wanted));
}

TEST(RegionGrowing, StartsFromItsSeedsOnly) {
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {0.4, 0, 0}, {0, 1, 0}),
                         rectangle_scan(eye, {0.6, 0, 0.01}, {0.4, 0, 0}, {0, 1, 0})});
  const auto middle = std::find_if(pending.all.begin(), pending.all.end(), [&](PointId i) {
    return (pending.position(i) - Eigen::Vector3d(0.2, 0.5, 0.01)).norm() < 0.03;
  });
  ASSERT_NE(middle, pending.all.end());
  RegionGrowing grow(pending.ledger, pending.state.parameters);
  const Regions regions = grow(std::span(&*middle, 1), [](PointId) { return true; });
  ASSERT_EQ(regions.size(), 1U);
  for (const PointId i : regions[0]) EXPECT_LT(pending.position(i).x(), 0.41);
  EXPECT_TRUE(grow(pending.all, [](PointId) { return true; }).size() == 1) << "what was visited is done";
}

TEST(RegionGrowing, LeavesOutWhatIsTooSmall) {
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {0.5, 0, 0}, {0, 0.5, 0}),
                         rectangle_scan(eye, {0.8, 0.8, 0.01}, {0.1, 0, 0}, {0, 0.1, 0})});
  const Regions regions = grown(pending);
  ASSERT_EQ(regions.size(), 1U);
  for (const PointId i : regions[0]) EXPECT_LT(pending.position(i).x(), 0.6);
  EXPECT_LT(pending.all.size() - regions[0].size(),
            static_cast<std::size_t>(pending.state.parameters.min_surface_points()));
}

TEST(RegionGrowing, SurfacesPointsAreNoNeighbours) {
  // A strip through the middle belongs to a surface: the pending halves stay apart.
  PendingPoints pending({rectangle_scan(eye, {0, 0, 0.01}, {1, 0, 0}, {0, 1, 0})});
  surfaces::SurfaceModel& surface =
      pending.state.surfaces.create({Eigen::Vector3d::UnitZ(), 0.01}, {0.5, 0.5, 0.01});
  for (const PointId i : pending.all)
    if (std::fabs(pending.position(i).x() - 0.5) < 0.1) pending.ledger.give(i, surface);
  std::erase_if(pending.all, [&](PointId i) { return pending.ledger.window[i].surface != 0; });
  const Regions regions = grown(pending);
  ASSERT_EQ(regions.size(), 2U);
  EXPECT_EQ(regions[0].size() + regions[1].size(), pending.all.size());
}

/// The slow twin: every point asks all others.
Regions grown_slowly(PendingPoints& pending) {
  const surfaces::NormalField& normals = pending.ledger.normals;
  const float cos_smooth = static_cast<float>(std::cos(pending.state.parameters.detection.smoothness_angle));
  std::set<PointId> left(pending.all.begin(), pending.all.end());
  const auto flat = [&](PointId i) { return normals.at(i).known && normals.at(i).flat; };
  const auto near = [&](PointId a, PointId b) {
    const geometry::VoxelKey p = pending.ledger.window[a].key, q = pending.ledger.window[b].key;
    return std::max({std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)}) <= normals.at(a).reach;
  };
  Regions regions;
  while (true) {
    std::optional<PointId> seed;
    for (const PointId i : pending.all)  // in key order: of equals the first
      if (left.contains(i) && flat(i) && (!seed || normals.at(i).curvature < normals.at(*seed).curvature))
        seed = i;
    if (!seed) break;
    std::vector<PointId> region{*seed};
    left.erase(*seed);
    for (std::size_t k = 0; k < region.size(); ++k) {
      if (!flat(region[k])) continue;
      for (const PointId i : pending.all)
        if (left.contains(i) && near(region[k], i) && normals.at(i).known &&
            normals.at(i).normal.dot(normals.at(region[k]).normal) >= cos_smooth) {
          region.push_back(i);
          left.erase(i);
        }
    }
    if (region.size() >= static_cast<std::size_t>(pending.state.parameters.min_surface_points()))
      regions.push_back(region);
  }
  return regions;
}

TEST(RegionGrowing, AgreesWithTheSlowTwinWhateverTheOrderOfSeeds) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0, 1);
  std::size_t compared = 0;
  for (int round = 0; round < 4; ++round) {
    test::Scene scene;
    scene.rectangle({-1, -1, 0.01}, {2, 0, 0}, {0, 2, 0});
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d low(uniform(rng) - 0.7, uniform(rng) - 0.7, 0.01);
      scene.box(low, low + Eigen::Vector3d(0.2 + 0.2 * uniform(rng), 0.2 + 0.2 * uniform(rng),
                                           0.1 + 0.2 * uniform(rng)));
    }
    Parameters parameters;
    parameters.occupancy.resolution = 0.03;
    test::Camera camera;
    camera.width = 120;
    camera.height = 90;
    camera.focal = 100;
    camera.noise = 0.004 * uniform(rng);
    PendingPoints pending({test::camera_scan(scene, test::look_at({1.2, -1.1, 1.3}, {0, 0, 0}), rng, camera)},
                          parameters);
    Regions expected = grown_slowly(pending);
    std::shuffle(pending.all.begin(), pending.all.end(), rng);
    Regions regions = grown(pending);
    ASSERT_EQ(regions.size(), expected.size());
    compared += regions.size();
    for (std::size_t k = 0; k < regions.size(); ++k) {
      EXPECT_EQ(regions[k].front(), expected[k].front()) << "the flattest that is left";
      std::sort(regions[k].begin(), regions[k].end());
      std::sort(expected[k].begin(), expected[k].end());
      EXPECT_EQ(regions[k], expected[k]);
    }
  }
  EXPECT_GT(compared, 4U) << "the floor, and a box here or there";
}

}  // namespace
}  // namespace octosurf::cylinders
