// A follower whose allocations fail, each in turn.
#include "mapper/failing_memory.hpp"
#include "support/random_scans.hpp"
#include "support/same_octree.hpp"

#include <octosurf/adapters/octomap_follower.hpp>
#include <octosurf/adapters/octree.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

TEST(FollowerWithoutMemory, KeepsTheLastTreeAndCatchesUp) {
  Mapper mapper(test::of_voxels(0.2, false));
  std::mt19937_64 random = test::rng();
  std::vector<OccupancyView> views;
  for (int i = 0; i < 4; ++i) {
    mapper.insert(test::room_scan(random, 300, {1, 1, 1}, {0.5 * i, 0, 0}));
    views.push_back(mapper.map().octree());
  }
  const auto last = to_octree(views[2]);
  std::size_t failures = 0;
  const auto try_failing = [&](int followed_before, std::size_t n) {
    OctomapFollower follower;
    for (int i = 0; i < followed_before; ++i) follower.follow(views[static_cast<std::size_t>(i)]);
    const auto before = follower.tree();
    test::fail_allocation_after(n);
    bool threw = false;
    try {
      follower.follow(views[2]);
    } catch (const std::bad_alloc&) {
      threw = true;
    }
    if (test::stop_failing() == 0) return false;  // there are no more than n
    ++failures;
    EXPECT_TRUE(threw);
    EXPECT_EQ(follower.tree(), before);
    if (before) test::expect_same(*before, *to_octree(views[static_cast<std::size_t>(followed_before) - 1]));
    test::expect_same(*follower.follow(views[2]), *last);
    test::expect_same(*follower.follow(views[3]), *to_octree(views[3]));
    return true;
  };
  // The first tree, the second, and one that is brought up to date, at most some hundred failures each.
  for (int followed_before = 0; followed_before <= 2; ++followed_before) {
    std::size_t n = 0;
    while (try_failing(followed_before, n)) n += 1 + n / 50;
    EXPECT_GT(n, 20u);
  }
  EXPECT_GT(failures, 150u);
}

}  // namespace
}  // namespace octosurf
