// OctomapFollower against a slow twin: to_octree() of the same view, from scratch.
#include "support/random_scans.hpp"
#include "support/same_octree.hpp"

#include <octosurf/adapters/octomap_follower.hpp>
#include <octosurf/adapters/octree.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

using test::expect_same;
using TreePtr = std::shared_ptr<const octomap::OcTree>;

Parameters coarse(double resolution = 0.1) {
  Parameters parameters = test::of_voxels(resolution, false);
  parameters.occupancy.max_range = 3;
  return parameters;
}

class Following : public ::testing::Test {
 protected:
  OccupancyView scanned() {
    mapper.insert(test::room_scan(random, 1500, {1.5, 1, 1.2}, {0.1 * scans++, 0, 0}));
    return mapper.map().octree();
  }

  std::mt19937_64 random = test::rng();
  Mapper mapper{coarse()};
  OctomapFollower follower;
  int scans = 0;
};

TEST_F(Following, EqualsTheTreeMadeAnewAtEachScanAndWhatAReaderHoldsStaysAsItWas) {
  EXPECT_EQ(follower.tree(), nullptr);
  for (const bool slow_reader : {false, true}) {
    std::set<const octomap::OcTree*> used;
    TreePtr held;
    OccupancyView then;
    for (int i = 0; i < 12; ++i) {
      const OccupancyView now = scanned();
      const TreePtr tree = follower.follow(now);
      EXPECT_EQ(tree, follower.tree());
      expect_same(*tree, *to_octree(now));
      used.insert(tree.get());
      if (held) expect_same(*held, *to_octree(then));
      if (!slow_reader || i % 5 != 0) continue;
      held = tree;
      then = now;
    }
    EXPECT_EQ(used.size(), slow_reader ? 3u : 2u);  // in turn; a slow reader costs one tree more
  }
}

TEST_F(Following, GoesBackAndToOtherMaps) {
  const OccupancyView early = scanned(), late = scanned();
  follower.follow(early);
  follower.follow(late);
  expect_same(*follower.follow(early), *to_octree(early));
  Mapper other(coarse()), finer(coarse(0.05));
  other.insert(test::room_scan(random, 1500, {1, 1, 1}));
  finer.insert(test::room_scan(random, 1500, {1, 1, 1}));
  for (const OccupancyView& view : {other.map().octree(), finer.map().octree(), Map(coarse()).octree(), late})
    expect_same(*follower.follow(view), *to_octree(view));
}

TEST_F(Following, TreesCountAsOccupiedWhatTheMapDoes) {
  Parameters parameters = coarse();
  parameters.occupancy.occupied = 0.8;
  Mapper strict(parameters);
  strict.insert(test::room_scan(random, 1500, {1.5, 1, 1.2}));
  OctomapFollower strict_follower;
  const TreePtr tree = strict_follower.follow(strict.map().octree());
  std::size_t between = 0;
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf) {
    const octomap::point3d at = leaf.getCoordinate();
    const bool occupied =
        strict.map().octree().at({at.x(), at.y(), at.z()}).state == OccupancyView::State::occupied;
    ASSERT_EQ(tree->isNodeOccupied(*leaf), occupied);
    between += leaf->getLogOdds() > 0 && !occupied;
  }
  EXPECT_GT(between, 0u);  // which OctoMap's default would take for occupied
}

TEST_F(Following, AViewOfNothingIsRefusedAndTreesOutliveTheFollower) {
  const OccupancyView now = scanned();
  TreePtr tree;
  {
    OctomapFollower short_lived;
    tree = short_lived.follow(now);
    EXPECT_THROW(short_lived.follow(OccupancyView()), Error);
    const OctomapFollower moved = std::move(short_lived);
    EXPECT_EQ(moved.tree(), tree);
  }
  expect_same(*tree, *to_octree(now));
}

/// What a tree holds, whoever writes into it meanwhile.
double sum_of(const octomap::OcTree& tree) {
  double sum = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) sum += leaf->getLogOdds();
  return sum;
}

TEST_F(Following, ReadersInOtherThreadsSeeWholeTreesThatDoNotChange) {
  follower.follow(scanned());
  std::atomic<bool> done{false};
  std::atomic<int> read{0}, changed{0};
  const auto reader = [&] {
    do {
      const TreePtr tree = follower.tree();
      const double before = sum_of(*tree);
      std::this_thread::yield();
      changed += sum_of(*tree) != before || tree->calcNumNodes() != tree->size();
      ++read;
    } while (!done);
  };
  std::thread one(reader), two(reader);
  for (int i = 0; i < 25; ++i) {
    const OccupancyView now = scanned();
    expect_same(*follower.follow(now), *to_octree(now));
  }
  done = true;
  one.join();
  two.join();
  EXPECT_GT(read, 10);
  EXPECT_EQ(changed, 0);
}

}  // namespace
}  // namespace octosurf
