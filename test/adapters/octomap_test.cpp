// The batched insertion for plain OctoMap trees against OctoMap's own, node by node.
#include "support/same_octree.hpp"
#include "support/seed.hpp"

#include <octomap/ColorOcTree.h>
#include <octomap/OcTreeStamped.h>

#include <octosurf/adapters/octomap.hpp>

namespace octosurf {
namespace {

using test::expect_same;

struct CloudScan {
  octomap::Pointcloud cloud;
  octomap::point3d origin;
};

/// Noisy points on a wall, a floor and anywhere, from somewhere.
CloudScan random_scan(std::mt19937_64& rng, const octomap::point3d& around, std::size_t points) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto somewhere = [&](float reach) {
    return around + octomap::point3d(reach * uniform(rng), reach * uniform(rng), reach * uniform(rng));
  };
  CloudScan scan{{}, somewhere(0.4F)};
  for (std::size_t i = 0; i < points; ++i) {
    octomap::point3d p = somewhere(1.5F);
    if (i % 3 == 0) p.x() = around.x() + 1.2F + 0.01F * uniform(rng);
    if (i % 3 == 1) p.z() = around.z() - 0.9F + 0.01F * uniform(rng);
    scan.cloud.push_back(p);
    if (i % 5 == 0) scan.cloud.push_back(p);  // a voxel may be hit twice
  }
  return scan;
}

struct Arguments {
  double max_range;
  bool lazy, discretize;
};

template <class Tree>
void insert_both_ways(Tree& ours, Tree& theirs, const Arguments& with, std::size_t points, double shift = 0) {
  std::mt19937_64 rng(test::seed());
  const auto at = static_cast<float>(shift);
  for (int i = 0; i < 5; ++i) {
    const CloudScan scan = random_scan(rng, {at, -at, at}, points);
    theirs.insertPointCloud(scan.cloud, scan.origin, with.max_range, with.lazy, with.discretize);
    insert_point_cloud(ours, scan.cloud, scan.origin, with.max_range, with.lazy, with.discretize, 1 + i % 2);
    expect_same(ours, theirs);
  }
  if (!with.lazy) return;
  ours.updateInnerOccupancy();
  theirs.updateInnerOccupancy();
  expect_same(ours, theirs);
}

TEST(InsertPointCloud, EqualsOctomapsForAllArguments) {
  for (const double max_range : {-1.0, 0.8})
    for (const bool lazy : {false, true})
      for (const bool discretize : {false, true}) {
        SCOPED_TRACE(testing::Message() << max_range << " lazy " << lazy << " discretize " << discretize);
        octomap::OcTree ours(0.03), theirs(0.03);
        insert_both_ways(ours, theirs, {max_range, lazy, discretize}, 500);
      }
}

TEST(InsertPointCloud, EqualsOctomapsFarFromTheOriginAndOnDerivedTrees) {
  octomap::OcTree ours(0.05), theirs(0.05);
  insert_both_ways(ours, theirs, {-1, false, true}, 3000, 301.7);
  octomap::ColorOcTree our_colors(0.04), their_colors(0.04);
  insert_both_ways(our_colors, their_colors, {-1, false, true}, 800);
}

TEST(InsertPointCloud, EqualsOctomapsWhenVoxelsSaturate) {
  for (const bool lazy : {false, true}) {
    octomap::OcTree ours(0.2), theirs(0.2);
    for (octomap::OcTree* tree : {&ours, &theirs}) {
      tree->setClampingThresMin(0.4);  // after one miss
      tree->setClampingThresMax(0.75);
    }
    insert_both_ways(ours, theirs, {-1, lazy, true}, 4000);
    insert_both_ways(ours, theirs, {-1, lazy, true}, 4000);
  }
}

/// Every leaf of `some` has its value and a stamp in `others` too, divided or not.
void expect_stamped_alike(const octomap::OcTreeStamped& some, const octomap::OcTreeStamped& others) {
  for (auto leaf = some.begin_leafs(); leaf != some.end_leafs(); ++leaf) {
    const octomap::OcTreeNodeStamped* other = others.search(leaf.getKey());
    ASSERT_NE(other, nullptr);
    ASSERT_EQ(leaf->getLogOdds(), other->getLogOdds());
    ASSERT_EQ(leaf->getTimestamp() != 0, other->getTimestamp() != 0);
  }
}

TEST(InsertPointCloud, LetsTheTreeUpdateItsNodes) {
  // This one stamps them with the second, and does not prune what was stamped in different ones: so
  // its shape depends on the clock.
  octomap::OcTreeStamped ours(0.04), theirs(0.04);
  std::mt19937_64 rng(test::seed());
  for (int i = 0; i < 5; ++i) {
    const CloudScan scan = random_scan(rng, {}, 800);
    theirs.insertPointCloud(scan.cloud, scan.origin, -1, false, true);
    insert_point_cloud(ours, scan.cloud, scan.origin);
  }
  expect_stamped_alike(ours, theirs);
  expect_stamped_alike(theirs, ours);
}

TEST(InsertPointCloud, GoesOctomapsWayWhereItsStateIsOutOfReach) {
  octomap::OcTree ours(0.05), theirs(0.05);
  for (octomap::OcTree* tree : {&ours, &theirs}) {
    tree->useBBXLimit(true);
    octomap::point3d low(-0.5F, -0.5F, -2), high(2, 2, 2);
    tree->setBBXMin(low);
    tree->setBBXMax(high);
  }
  insert_both_ways(ours, theirs, {-1, false, true}, 400);
  octomap::OcTree our_changes(0.05), their_changes(0.05);
  our_changes.enableChangeDetection(true);
  their_changes.enableChangeDetection(true);
  insert_both_ways(our_changes, their_changes, {-1, false, true}, 400);
  EXPECT_EQ(our_changes.numChangesDetected(), their_changes.numChangesDetected());
  EXPECT_GT(our_changes.numChangesDetected(), 0U);
}

TEST(InsertPointCloud, LeavesOutWhatIsNoPointOfTheMap) {
  octomap::OcTree tree(0.05), without(0.05);
  octomap::Pointcloud good, bad;
  good.push_back(1, 0.2F, 0.3F);
  bad.push_back(1, 0.2F, 0.3F);
  bad.push_back(std::nanf(""), 0, 0);
  bad.push_back(0, std::numeric_limits<float>::infinity(), 0);
  bad.push_back(1e6F, 0, 0);
  insert_point_cloud(tree, bad, {0.01F, 0.01F, 0.01F});
  insert_point_cloud(without, good, {0.01F, 0.01F, 0.01F});
  expect_same(tree, without);
  insert_point_cloud(tree, {}, {0, 0, 0});
  expect_same(tree, without);
  octomap::OcTree empty(0.05);
  insert_point_cloud(empty, {}, {0, 0, 0});
  EXPECT_EQ(empty.size(), 0U);
}

}  // namespace
}  // namespace octosurf
