#include "alignment/near_surfaces.hpp"

#include "alignment/surfaces_by_hand.hpp"
#include "surfaces/map_state.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

struct OffsetVariances {
  double published = 0, used = 0;
};

/// Of a long table, along which a robot looks once from where it says it is and once from poses that have
/// slid `slid_m` along the table's normal; the second time it sees a little more.
OffsetVariances after_slide(double slid_m) {
  auto rng = test::rng();
  Scene scene;
  scene.rectangle({0.03, 0.03, 0.03}, {3, 0, 0}, {0, 0.8, 0});
  Parameters parameters;
  parameters.align = false;
  Mapper mapper(parameters);
  for (const bool again : {false, true})
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d target(0.6 + 0.12 * i + (again ? 0.3 : 0), 0.43, 0.03);
      Scan scan = camera_scan(scene, look_at(target + Eigen::Vector3d(0, -0.6, 1), target), rng);
      if (again) scan.T_map_sensor.translation().z() += slid_m;
      mapper.insert(scan);
    }
  const surfaces::MapState& state = surfaces::state_of(mapper.map());
  const auto snapshot = mapper.snapshot();
  EXPECT_EQ(snapshot->surfaces.size(), 1U);
  alignment::NearSurfaces near;
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  const alignment::AlignedSurface& table = *near.in(*snapshot, everywhere, &state).at(0);
  return {snapshot->surfaces.at(0)->covariance(2, 2), (table.covariance - table.by_boundary)(2, 2)};
}

TEST(NearSurfaces, PosesThatSlidDoNotMakeAPlaneUncertain) {
  const OffsetVariances slid = after_slide(0.004), exact = after_slide(0);
  // Weighed as it is published, the table would hardly hold a pose that slides off it …
  EXPECT_GT(slid.published, 100 * exact.published);
  EXPECT_GT(slid.published, 20 * slid.used);
  // … while its readings lie at two heights 4 mm apart, that is scatter by 2 mm, where voxels' means scatter
  // by half a millimetre or more otherwise: (2² + 0.5²) / 0.5² times the variance at most.
  EXPECT_LT(slid.used, 17 * exact.used);
  EXPECT_LE(exact.used, 1.0001 * exact.published);  // the boundary was taken off it again
}

TEST(NearSurfaces, AFinishedMapIsAsSureAsItSays) {
  Scene scene;
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto map = map_of_rectangles(scene, {0, 0, 1});
  alignment::NearSurfaces near;
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  const alignment::AlignedSurface& floor = *near.in(*map, everywhere).at(0);
  EXPECT_EQ(floor.covariance, map->surfaces.at(0)->covariance + floor.by_boundary);
}

// Among scans that are mapped together, the first may take back a surface that the snapshot still has.
TEST(NearSurfaces, WhatIsGoneButPublishedStillIsNotNear) {
  Scene scene;
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto published = map_of_rectangles(scene, {0, 0, 1});
  const Mapper mapper{Parameters{}};  // whose map has no surface
  const surfaces::MapState& state = surfaces::state_of(mapper.map());
  alignment::NearSurfaces near;
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  EXPECT_EQ(near.in(*published, everywhere).size(), 1U);
  EXPECT_TRUE(near.in(*published, everywhere, &state).empty());
}

}  // namespace
}  // namespace octosurf::test
