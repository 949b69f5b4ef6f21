// Who keeps an id when a map is built anew.
#include "surfaces/succession.hpp"

#include "support/invariants.hpp"
#include "support/scene.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

using surfaces::Succeeded;
using surfaces::Succession;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct Mapped {
  Map map;
  std::vector<Scan> scans;
};

/// Ids begin with `first_id`, so that they are no one else's by chance.
Map map_of(const std::vector<Scan>& scans, SurfaceId first_id) {
  Map start;
  surfaces::state_of(start).surfaces.set_next_id(first_id);
  Mapper mapper(std::move(start));
  for (const Scan& scan : scans) mapper.insert(scan);
  return std::move(mapper).release();
}

/// Straight down from 1.2 m above strips of a floor, `along` x one beside the other. `heights`: of each.
std::vector<Scan> strips(const std::vector<double>& heights, std::mt19937_64 random) {
  std::vector<Scan> scans;
  Camera camera;
  camera.width = 100;
  camera.height = 100;
  camera.focal = 120;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    Scene scene;
    const double x = static_cast<double>(i), z = heights[i];
    scene.rectangle({x, 0, z}, {1, 0, 0}, {0, 1, 0});
    const Eigen::Vector3d above(x + 0.5, 0.5, z + 1.2);
    scans.push_back(camera_scan(scene, look_at(above, above - Eigen::Vector3d::UnitZ()), random, camera));
  }
  return scans;
}

/// Gives `after` the ids of `before`, by every finite reading of the same scans.
Succeeded renumbered(const Mapped& before, Mapped& after) {
  Succession succession(surfaces::state_of(before.map));
  const geometry::VoxelGrid& grid = surfaces::state_of(after.map).occupancy.grid();
  for (std::size_t i = 0; i < before.scans.size(); ++i)
    for (const Eigen::Vector3f& p : before.scans[i].points) {
      geometry::VoxelKey old_key, new_key;
      if (!p.allFinite()) continue;
      if (grid.key_of((before.scans[i].T_map_sensor * p.cast<double>()).cast<float>(), old_key) &&
          grid.key_of((after.scans[i].T_map_sensor * p.cast<double>()).cast<float>(), new_key))
        succession.add(old_key, surfaces::state_of(after.map), new_key);
    }
  const Succeeded succeeded = succession.renumber(surfaces::state_of(after.map));
  EXPECT_THAT(check_invariants(after.map), IsEmpty());
  return succeeded;
}

std::vector<SurfaceId> ids_of(const Map& map) {
  std::vector<SurfaceId> ids;
  for (const SurfacePtr& surface : map.snapshot()->surfaces) ids.push_back(surface->id);
  return ids;
}

std::vector<Scan> moved(std::vector<Scan> scans, const Eigen::Isometry3d& T) {
  for (Scan& scan : scans) scan.T_map_sensor = T * scan.T_map_sensor;
  return scans;
}

TEST(Succession, SurfacesThatAreTheSameKeepTheirIdsWhateverTheyAreCalledNowAndWherever) {
  std::mt19937_64 random = rng();
  const std::vector<Scan> scans = strips({0, 0.5, 1, 1.5}, random);
  std::normal_distribution<double> any;
  Eigen::Isometry3d turned(
      Eigen::Quaterniond(any(random), any(random), any(random), any(random)).normalized());
  turned.translation() << any(random), any(random), any(random);
  for (const Eigen::Isometry3d& T : {Eigen::Isometry3d::Identity(), turned}) {
    const Mapped before{map_of(scans, 100), scans};
    Mapped after{map_of(moved(scans, T), 7), moved(scans, T)};
    const Succeeded surfaces = renumbered(before, after);
    EXPECT_EQ(ids_of(after.map), ids_of(before.map));
    EXPECT_EQ(surfaces.kept, 4U);
    EXPECT_THAT(surfaces.gone, IsEmpty());
    EXPECT_EQ(after.map.size().revision, before.map.size().revision + 1);
    EXPECT_EQ(surfaces::state_of(after.map).surfaces.next_id(),
              surfaces::state_of(before.map).surfaces.next_id());
    EXPECT_EQ(after.map.snapshot()->changed_since(before.map.size().revision).size(), 4U);
    for (const SurfacePtr& surface : before.map.snapshot()->surfaces) {
      const Surface* there = after.map.snapshot()->find(surface->id);
      ASSERT_NE(there, nullptr);
      // 2 mm of noise over some 2,500 voxels: 0.04 mm; edges' voxels are cut otherwise where they are turned.
      const bool same = T.matrix().isIdentity();
      EXPECT_LT((there->plane.normal - T.linear() * surface->plane.normal).norm(), same ? 1e-9 : 0.002);
      EXPECT_LT(std::fabs(there->plane.signed_distance(T * surface->T_map_surface.translation())),
                same ? 1e-9 : 0.0005);
    }
  }
}

TEST(Succession, WhatWasTwoAndIsOneKeepsTheLargersIdAndTheOtherAsParent) {
  std::mt19937_64 random = rng();
  const std::vector<Scan> apart = strips({0, 0, 0.1}, random);  // the third's pose was wrong
  std::vector<Scan> level = apart;
  level[2].T_map_sensor.translation().z() -= 0.1;
  Mapped before{map_of(apart, 10), apart};
  Mapped after{map_of(level, 1), level};
  ASSERT_EQ(before.map.snapshot()->surfaces.size(), 2U);
  ASSERT_EQ(after.map.snapshot()->surfaces.size(), 1U);
  const auto& two = before.map.snapshot()->surfaces;
  const bool first_is_larger = two[0]->inliers > two[1]->inliers;
  const SurfaceId larger = two[first_is_larger ? 0 : 1]->id, smaller = two[first_is_larger ? 1 : 0]->id;
  const Succeeded merged = renumbered(before, after);
  EXPECT_THAT(ids_of(after.map), ElementsAre(larger));
  EXPECT_THAT(merged.gone, ElementsAre(smaller));
  EXPECT_THAT(after.map.snapshot()->surfaces[0]->parents, Contains(smaller));

  // And back again: the larger part keeps the id, the other gets a new one, split from it.
  Mapped again{map_of(apart, 1), apart};
  const SurfaceId unused = surfaces::state_of(after.map).surfaces.next_id();
  EXPECT_GT(unused, smaller);
  const Succeeded split = renumbered(after, again);
  EXPECT_THAT(ids_of(again.map), ElementsAre(larger, unused));
  EXPECT_THAT(again.map.snapshot()->find(unused)->parents, ElementsAre(larger));
  EXPECT_THAT(split.gone, IsEmpty());
  EXPECT_EQ(surfaces::state_of(again.map).surfaces.next_id(), unused + 1);
}

TEST(Succession, AnotherMapsSurfacesShareNone) {
  const std::vector<Scan> here = strips({0, 0.5}, rng());
  Eigen::Isometry3d far = Eigen::Isometry3d::Identity();
  far.translation().x() = 50;
  const Mapped before{map_of(here, 3), here};
  Mapped after{map_of(moved(here, far), 1), moved(here, far)};
  const Succession nothing_shared(surfaces::state_of(before.map));
  nothing_shared.renumber(surfaces::state_of(after.map));
  EXPECT_THAT(ids_of(after.map), ElementsAre(5, 6));
  for (const SurfacePtr& surface : after.map.snapshot()->surfaces) EXPECT_THAT(surface->parents, IsEmpty());
  EXPECT_THAT(check_invariants(after.map), IsEmpty());
}

}  // namespace
}  // namespace octosurf::test
