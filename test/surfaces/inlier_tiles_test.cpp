// Inliers by cell, beside a plain map of lists.
#include "surfaces/inlier_tiles.hpp"

#include "support/testing.hpp"

namespace octosurf::test {
namespace {

auto fields(const surfaces::Inlier& inlier) {
  return std::tuple(inlier.key.packed(), inlier.range_class, inlier.position.x(), inlier.position.y(),
                    inlier.position.z());
}
using Fields = decltype(fields({}));

std::vector<Fields> fields_of(const std::vector<surfaces::Inlier>& inliers) {
  std::vector<Fields> all;
  for (const surfaces::Inlier& inlier : inliers) all.push_back(fields(inlier));
  return all;
}

using Lists = std::map<std::pair<int, int>, std::vector<surfaces::Inlier>>;

std::vector<surfaces::Inlier> in_cell(const surfaces::InlierTiles& tiles, geometry::PlaneCell cell) {
  std::vector<surfaces::Inlier> inliers;
  tiles.for_each_in(cell, [&](const surfaces::Inlier& inlier) { inliers.push_back(inlier); });
  return inliers;
}

void expect_same(const surfaces::InlierTiles& tiles, const Lists& lists) {
  std::size_t all = 0, listed = 0;
  tiles.for_each([&](const surfaces::Inlier&) { ++all; });
  for (int v = -20; v < 20; ++v)
    for (int u = -20; u < 20; ++u) {
      const auto list = lists.find({u, v});
      const std::vector<surfaces::Inlier> there =
          list == lists.end() ? std::vector<surfaces::Inlier>{} : list->second;
      listed += there.size();
      ASSERT_EQ(fields_of(in_cell(tiles, {u, v})), fields_of(there)) << u << ' ' << v;
    }
  ASSERT_EQ(all, listed);
}

TEST(InlierTiles, AreTheListsOfTheirCells) {
  std::mt19937_64 random = rng();
  std::uniform_int_distribution<int> place(-18, 18);
  std::uniform_real_distribution<float> metres(-9, 9);
  surfaces::InlierTiles tiles;
  Lists lists;
  for (std::uint16_t round = 0; round < 6000; ++round) {
    const geometry::PlaneCell cell{place(random), place(random) / 3};  // several inliers a cell
    std::vector<surfaces::Inlier>& list = lists[{cell.u, cell.v}];
    if (random() % 2 == 0) {
      const surfaces::Inlier inlier{{round, 2, 3},
                                    static_cast<std::uint8_t>(random() % 8),
                                    {metres(random), metres(random), metres(random)}};
      tiles.add(cell, inlier);
      list.push_back(inlier);
    } else if (list.empty()) {
      EXPECT_FALSE(tiles.remove(cell, {round, 2, 3}).has_value());
    } else {
      const auto taken = list.begin() + static_cast<std::ptrdiff_t>(random() % list.size());
      EXPECT_FALSE(tiles.remove(cell, {taken->key.x, 2, 4}).has_value());
      const auto removed = tiles.remove(cell, taken->key);
      ASSERT_TRUE(removed.has_value());
      EXPECT_EQ(fields(removed->inlier), fields(*taken));
      list.erase(taken);
      EXPECT_EQ(removed->cell_empty, list.empty());
    }
    if (round % 500 == 0) expect_same(tiles, lists);
  }
  expect_same(tiles, lists);
  tiles.clear();
  expect_same(tiles, {});
}

}  // namespace
}  // namespace octosurf::test
