// What is taken back is as it was, to the last bit and for whoever goes on from there.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"
#include "support/random_scans.hpp"

namespace octosurf::occupancy {
namespace {

TEST(OctreeRollBack, IsAsIfNothingHadBeen) {
  OccupancyMap map(test::with_resolution(0.05)), without(test::with_resolution(0.05));
  auto rng = test::rng();
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  for (int i = 0; i < 12; ++i) {
    const Scan scan = test::room_scan(rng, 1500, {1.1 + uniform(rng), 1.2, 0.8 + uniform(rng)});
    const Scan other = test::room_scan(rng, 1500, {0.9 + uniform(rng), 1.0 + uniform(rng), 0.7});
    const std::string before = test::bytes_of(map);
    const OccupancyMap::Size size = map.size();
    const OccupancyView held = map.share();
    const test::Voxels as_held = test::voxels_of(held);
    map.begin_changes();
    test::insert(map, other);
    map.for_each_point([&](const VoxelPoint& p) { map.assign(p, p.key.x % 7); });
    ASSERT_NE(test::bytes_of(map), before);
    const OccupancyView of_changes = map.share();
    const test::Voxels as_changed = test::voxels_of(of_changes);
    map.roll_back();
    ASSERT_EQ(test::bytes_of(map), before);
    EXPECT_EQ(map.size().nodes, size.nodes);
    EXPECT_EQ(map.bytes(), size.bytes);
    map.begin_changes();
    test::insert(map, scan);
    map.commit();
    test::insert(without, scan);
    ASSERT_EQ(test::bytes_of(map), test::bytes_of(without)) << "goes on as another one";
    ASSERT_EQ(test::voxels_of(held), as_held);
    ASSERT_EQ(test::voxels_of(of_changes), as_changed);
  }
}

}  // namespace
}  // namespace octosurf::occupancy
