// What is remembered of a surface's patches, and how long ago that was.
#include "alignment/seen_patches.hpp"

#include "support/testing.hpp"

namespace octosurf::test {
namespace {

using alignment::Observation;
using alignment::SeenPatch;
using alignment::SeenPatches;

constexpr double span = 1;

Observation look_at_distance(double distance) {
  Observation observation;
  observation.weight = 1;
  observation.distance = static_cast<float>(distance);
  return observation;
}

TEST(SeenPatches, OldLooksAreAtLeastASpanOldAndNoneOfThreeSpansIsMissing) {
  auto rng = test::rng();
  std::uniform_real_distribution<double> step(0, 0.6);
  SeenPatch patch;
  std::vector<double> ways;
  for (double way = 0; way < 30; way += step(rng)) {
    const Observation before = patch.before(way, span);
    // Weights are 1 each and the distances are the ways: the oldest `n` observations have this mean.
    const auto n = static_cast<std::size_t>(before.weight + 0.5F);
    ASSERT_LE(n, ways.size());
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += ways[i] / static_cast<double>(n);
    if (n > 0) {
      EXPECT_NEAR(before.distance, sum, 1e-3);
      EXPECT_LE(ways[n - 1], way - span + 1e-9);
    }
    for (std::size_t i = n; i < ways.size(); ++i) EXPECT_GT(ways[i], way - 3 * span);
    if (ways.empty()) patch.since = way;
    patch.add(look_at_distance(way), way, span);
    ways.push_back(way);
  }
}

TEST(SeenPatches, LooksCountByTheirWeight) {
  Observation observation = look_at_distance(1), other = look_at_distance(4);
  other.weight = 2;
  other.by_error[3] = 3;
  observation.add(other);
  observation.add(Observation{});
  EXPECT_FLOAT_EQ(observation.weight, 3);
  EXPECT_FLOAT_EQ(observation.distance, 3);
  EXPECT_FLOAT_EQ(observation.by_error[3], 2);
}

}  // namespace
}  // namespace octosurf::test
