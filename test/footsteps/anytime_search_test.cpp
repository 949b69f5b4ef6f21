// The search over random graphs: begun, looked at and gone on with it is the search in one go.
#include "footsteps/anytime_search.hpp"

#include "support/testing.hpp"

namespace octosurf::footsteps {
namespace {

/// Nodes on a line, each with some steps forward or back; a step onto the last one completes a plan. Counts
/// how often a node's steps were asked for.
class RandomGraph {
 public:
  explicit RandomGraph(std::mt19937_64& random, NodeId nodes) : steps_(nodes) {
    std::uniform_real_distribution<float> cost(1, 3);
    for (NodeId node = 0; node < nodes; ++node)
      for (int i = 0; i < 4; ++i) {
        const NodeId to = std::min<NodeId>(nodes - 1, node + static_cast<NodeId>(random() % 6));
        steps_[node].push_back({to - std::min(to, static_cast<NodeId>(random() % 5)), cost(random)});
      }
  }

  const std::vector<StepEdge>& steps(NodeId node) {
    ++asked;
    return steps_[node];
  }
  bool passable(NodeId node, std::size_t step) const { return (node + step) % 7 != 0; }
  double guide(NodeId node) const { return 1.5 * bound(node); }
  double bound(NodeId node) const { return static_cast<double>(steps_.size() - 1 - node) / 5; }
  bool ends(NodeId, NodeId to) const { return to + 1 == steps_.size(); }
  std::size_t node_count() const { return steps_.size(); }

  std::size_t asked = 0;

 private:
  std::vector<std::vector<StepEdge>> steps_;
};

TEST(AnytimeSearch, GoneOnWithIsTheSearchInOneGoAndExpandsNothingTwice) {
  std::mt19937_64 random(test::seed());
  std::size_t found = 0;
  for (int round = 0; round < 200; ++round) {
    RandomGraph graph(random, 60);
    const PlanBudget budget{.expansions = 5 + random() % 100, .improving = random() % 100, .time_s = {}};
    const SearchOutcome whole = AnytimeSearch(graph, {0, 1}, budget).run();
    found += !whole.path.empty();
    graph.asked = 0;
    AnytimeSearch parts(graph, {0, 1}, budget);
    for (std::size_t some = 1; some < 80 && !parts.find(some); some += 1 + random() % 20) {
      EXPECT_LE(parts.so_far().expansions, std::min(some, budget.expansions));
      EXPECT_EQ(parts.left().expansions, budget.expansions - parts.so_far().expansions);
    }
    const SearchOutcome& again = parts.run();
    EXPECT_EQ(again.path, whole.path);
    EXPECT_EQ(again.cost, whole.cost);
    EXPECT_EQ(again.lower_bound, whole.lower_bound);
    EXPECT_EQ(again.expanded, whole.expanded);
    EXPECT_EQ(again.exhausted, whole.exhausted);
    EXPECT_EQ(again.expansions, whole.expansions);
    EXPECT_EQ(graph.asked, again.expansions);
  }
  EXPECT_GT(found, 20u);
  EXPECT_LT(found, 200u);
}

TEST(AnytimeSearch, TimeIsSpentOnce) {
  std::mt19937_64 random(test::seed());
  RandomGraph graph(random, 60);
  AnytimeSearch search(graph, {0}, {.expansions = 1000, .improving = 0, .time_s = 0.0});
  EXPECT_FALSE(search.find(10));
  EXPECT_TRUE(search.run().path.empty());
  EXPECT_EQ(search.left().time_s, 0.0);
  EXPECT_EQ(graph.asked, 0u);
}

}  // namespace
}  // namespace octosurf::footsteps
