// A map's octree as OctoMap's, and back, against OctoMap's own.
#include "support/random_scans.hpp"
#include "support/same_octree.hpp"

#include <octosurf/adapters/octree.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using test::expect_same;

Parameters plain_occupancy() {
  Parameters parameters;
  parameters.occupancy.resolution = 0.05;
  parameters.occupancy.preserve_surfaces = false;
  parameters.occupancy.max_range = 3;
  parameters.align = false;
  return parameters;
}

/// Both take the same scans.
class OctreeOfAMap : public ::testing::Test {
 protected:
  OctreeOfAMap() : mapper(plain_occupancy()) { set_model(theirs, mapper.map().parameters()); }
  void insert(int scans, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
    for (int i = 0; i < scans; ++i) {
      const Scan scan = test::room_scan(random, 1500, {1.5, 1, 1.2}, centre);
      mapper.insert(scan);
      octomap::Pointcloud cloud;
      for (const Eigen::Vector3f& p : scan.points) {
        const Eigen::Vector3f m =
            (scan.T_map_sensor.linear() * p.cast<double>() + scan.T_map_sensor.translation()).cast<float>();
        cloud.push_back(m.x(), m.y(), m.z());
      }
      const Eigen::Vector3f o = scan.T_map_sensor.translation().cast<float>();
      theirs.insertPointCloud(cloud, {o.x(), o.y(), o.z()}, 3, false, true);
    }
  }

  Mapper mapper;
  std::mt19937_64 random = test::rng();
  octomap::OcTree theirs{0.05};
};

TEST_F(OctreeOfAMap, EqualsOctomapsOwnNodeByNode) {
  insert(12);  // many hits: clamped voxels are pruned, those with points, too
  expect_same(*to_octree(mapper.map().octree()), theirs);
  insert(4, {0.4, 0.2, 0});
  expect_same(*to_octree(mapper.map().octree()), theirs);
}

TEST_F(OctreeOfAMap, BoxHoldsEveryVoxelThatMeetsItWithItsValueAndLittleElse) {
  insert(6);
  const OccupancyView view = mapper.map().octree();
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.4, -1.03, -0.2), Eigen::Vector3d(0.73, 0.41, 1.2));
  const std::unique_ptr<octomap::OcTree> part = to_octree(view, box);
  std::size_t inside = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
    const octomap::OcTreeKey corner = leaf.getIndexKey();
    const int edge = 1 << (16 - leaf.getDepth());
    for (int i = 0; i < edge * edge * edge; ++i) {
      const octomap::OcTreeKey key(static_cast<octomap::key_type>(corner[0] + i % edge),
                                   static_cast<octomap::key_type>(corner[1] + i / edge % edge),
                                   static_cast<octomap::key_type>(corner[2] + i / edge / edge));
      const Eigen::Vector3d low = 0.05 * Eigen::Vector3d(key[0] - 32768, key[1] - 32768, key[2] - 32768);
      const Eigen::AlignedBox3d voxel(low, low + Eigen::Vector3d::Constant(0.05));
      const octomap::OcTreeNode* found = part->search(key);
      if (box.intersects(voxel) && box.intersection(voxel).sizes().minCoeff() > 1e-9) {
        ASSERT_NE(found, nullptr);
        ASSERT_EQ(found->getLogOdds(), leaf->getLogOdds());
        ++inside;
      } else if (found != nullptr) {
        ASSERT_EQ(found->getLogOdds(), leaf->getLogOdds());
      }
    }
  }
  EXPECT_GT(inside, 5000u);
  EXPECT_LT(part->size(), theirs.size() / 2);
  EXPECT_EQ(part->calcNumNodes(), part->size());
  const Eigen::Vector3d far(50, 50, 50);
  EXPECT_EQ(to_octree(view, {far, far})->size(), 0u);
}

/// Following (test/octomap) has update_octree() between views of all kinds.
TEST_F(OctreeOfAMap, OneTakenInHasItsVoxelsAndGivesSurfaces) {
  insert(8);
  Map map = map_from_octree(theirs, plain_occupancy());
  expect_same(*to_octree(map.octree()), theirs);
  Mapper taken(std::move(map));
  taken.detect_in_occupancy();
  EXPECT_GE(taken.snapshot()->surfaces.size(), 5u);  // of the room's six sides
  update_octree(theirs, taken.map().octree(), OccupancyView());
  EXPECT_EQ(theirs.size(), 0u) << "brought to nothing";
}

TEST(MapFromLeaves, RefusesWhatNoOctreeHas) {
  using Leaf = OccupancyView::Leaf;
  const auto refused = [](const Leaf& leaf) {
    EXPECT_THROW(map_from_leaves(std::vector<Leaf>{leaf}, {}), Error);
  };
  refused({{0, 0, 0}, 17, 1});
  refused({{0, 0, 0}, 200, 1});
  refused({{1, 0, 0}, 1, 1});
  refused({{0, 0, 0}, 0, std::nanf("")});
  const Map map = map_from_leaves(std::vector<Leaf>{{{32768, 32768, 32768}, 2, 1.5F}}, {});
  EXPECT_EQ(map.at({0.07, 0.07, 0.07}).log_odds, 1.5F);
  EXPECT_EQ(map.at({0.09, 0.07, 0.07}).state, OccupancyView::State::unknown);
}

TEST(ToOctree, AViewOfNothingHasNoResolution) {
  EXPECT_THROW(to_octree(OccupancyView()), Error);
  const Map empty;
  EXPECT_EQ(to_octree(empty.octree())->size(), 0u);
  octomap::OcTree coarse(0.3);
  EXPECT_THROW(update_octree(coarse, empty.octree(), empty.octree()), Error);
}

}  // namespace
}  // namespace octosurf
