// Cached neighbours equal those of a search over all points.
#include "occupancy/neighbours.hpp"

#include "support/pending_points.hpp"

namespace octosurf::occupancy {
namespace {

TEST(Neighbours, AreAllPointsWithinTheSmallestDistanceThatGivesSix) {
  std::mt19937_64 rng = test::rng();
  // Dense at first, then ever sparser, up to lonely points.
  Scan scan;
  std::exponential_distribution<float> away(4);
  std::uniform_real_distribution<float> side(-1, 1);
  for (int k = 0; k < 1500; ++k)
    scan.points.emplace_back(away(rng) * side(rng), away(rng) * side(rng), 1 + away(rng) * side(rng));
  const test::PendingPoints points({scan});
  const PointWindow& window = points.ledger.window;
  const Neighbours neighbours(window, 0.02);
  const auto distance = [&](PointId a, PointId b) {
    const geometry::VoxelKey p = window[a].key, q = window[b].key;
    return std::max({std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)});
  };
  const auto within = [&](PointId i, int reach) {
    std::vector<PointId> near;
    for (const PointId j : points.all)
      if (j != i && distance(i, j) <= reach) near.push_back(j);
    return near;
  };
  for (const PointId i : points.all) {
    int reach = 1;
    while (reach < 8 && within(i, reach).size() < 6) ++reach;
    std::vector<PointId> found(neighbours.of(i).begin(), neighbours.of(i).end()), nearer;
    std::vector<PointId> expected = within(i, reach);
    std::sort(found.begin(), found.end());
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(found, expected);
    const int limit = 1 + static_cast<int>(rng() % 8);
    neighbours.for_each_within(i, limit, [&](PointId j) { nearer.push_back(j); });
    std::sort(nearer.begin(), nearer.end());
    expected = within(i, std::min(limit, reach));
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(nearer, expected) << limit;
  }
}

}  // namespace
}  // namespace octosurf::occupancy
