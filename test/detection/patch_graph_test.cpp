#include "detection/patch_graph.hpp"

#include "support/testing.hpp"

namespace octosurf::detection {
namespace {

/// A level square of exact readings of 2 mm noise about (x, 0, z).
Patch level(double x, double z, double facing = 1) {
  Patch patch;
  patch.plane.normal = {0, 0, facing};
  patch.origin = {x, 0, z};
  for (int i = -5; i <= 5; ++i)
    for (int j = -5; j <= 5; ++j) {
      patch.moments.add({0.02 * i, 0.02 * j, 0}, 1 / (0.002 * 0.002));
      ++patch.readings;
      ++patch.hits;
      patch.log_peaks += 5;  // of 2 mm
    }
  patch.fit();
  return patch;
}

TEST(PatchGraph, JoinsAChainOfOnePlane) {
  PatchGraph graph({Patch(), level(0, 0), level(0.22, 0), level(0.44, 0), level(0.22, 0.3)});
  graph.meet(1, 2, {0.11, 0, 0}, 11);
  graph.meet(2, 3, {0.33, 0, 0}, 0);  // across a gap
  const PatchGraph::Merged merged = std::move(graph).merge();
  ASSERT_EQ(merged.patches.size(), 3U);
  EXPECT_EQ(merged.into[0], clutter);
  EXPECT_EQ(merged.into[1], merged.into[2]);
  EXPECT_EQ(merged.into[1], merged.into[3]);
  EXPECT_NE(merged.into[1], merged.into[4]);
  EXPECT_EQ(merged.patches[merged.into[1]].readings, 3 * 121);
}

TEST(PatchGraph, LeavesStepsAndBacksApartHoweverLongTheirRimAndWhatDoesNotMeet) {
  for (const double rim : {11.0, 10000.0}) {
    PatchGraph graph({Patch(), level(0, 0), level(0.22, 0.05), level(0, -0.002, -1), level(0.22, 0)});
    graph.meet(1, 2, {0.11, 0, 0.02}, rim);
    graph.meet(1, 3, {0, 0, 0}, 100);
    EXPECT_EQ(std::move(graph).merge().patches.size(), 5U);
  }
}

/// A chain of level squares and of squares a step higher, met in any order of labels.
std::vector<std::size_t> sizes_of_merged(const std::vector<std::size_t>& order) {
  std::vector<Patch> patches(1);
  std::vector<Label> label(order.size());
  for (const std::size_t k : order) {
    label[k] = static_cast<Label>(patches.size());
    patches.push_back(level(0.22 * static_cast<double>(k), k % 5 == 4 ? 0.05 : 0));
  }
  PatchGraph graph(std::move(patches));
  for (std::size_t k = 0; k + 1 < order.size(); ++k)
    for (std::size_t l = k + 1; l < std::min(order.size(), k + 3); ++l)
      graph.meet(label[k], label[l], {0.11 * static_cast<double>(k + l), 0, 0}, 11);
  const PatchGraph::Merged merged = std::move(graph).merge();
  std::vector<std::size_t> sizes;
  for (const Label l : label)
    sizes.push_back(static_cast<std::size_t>(merged.patches[merged.into[l]].readings));
  return sizes;
}

TEST(PatchGraph, OrderOfPatchesDoesNotMatter) {
  std::mt19937_64 rng = test::rng();
  std::vector<std::size_t> order(30);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::vector<std::size_t> expected = sizes_of_merged(order);
  EXPECT_EQ(expected[0], 24U * 121);  // all that are level, past the steps
  EXPECT_EQ(expected[4], 121U);
  for (int trial = 0; trial < 5; ++trial) {
    std::shuffle(order.begin(), order.end(), rng);
    EXPECT_EQ(sizes_of_merged(order), expected);
  }
}

}  // namespace
}  // namespace octosurf::detection
