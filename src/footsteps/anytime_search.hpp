#pragma once

#include "geometry/interruption.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include <octosurf/footsteps.hpp>

namespace octosurf::footsteps {

using NodeId = std::uint32_t;
inline constexpr NodeId no_node = std::numeric_limits<NodeId>::max();

/// A step within its limits. Collisions are checked later, because most steps are never taken.
struct StepEdge {
  NodeId to = no_node;
  float cost = 0;
  enum class Collision : std::uint8_t { unchecked, free, blocked } collision = Collision::unchecked;
};

struct SearchOutcome {
  std::vector<NodeId> path;  ///< empty: none found
  double cost = std::numeric_limits<double>::infinity();
  double lower_bound = 0;
  std::size_t expansions = 0;
  bool exhausted = false;        ///< every reachable node was expanded
  std::vector<NodeId> expanded;  ///< of the first pass, in order
};

/// Anytime A* by restarts (Richter, Thayer and Ruml 2010): weighted A* with `guide`, which may overestimate,
/// at decreasing weights, then A* with `bound`, which does not. The graph caches its evaluations between
/// passes. Steps are checked for collisions when they leave the queue (lazy weighted A*, Cohen, Phillips and
/// Likhachev 2014).
///
/// Graph: `const std::vector<StepEdge>& steps(NodeId)`, `bool passable(NodeId, std::size_t index of the
/// step)`, `double guide(NodeId)`, `double bound(NodeId)` (consistent; both infinite where the goal cannot be
/// reached), `bool ends(NodeId from, NodeId to)` (this step completes a plan), `std::size_t node_count()`.
template <class Graph>
class AnytimeSearch {
 public:
  AnytimeSearch(Graph& graph, std::vector<NodeId> starts, const PlanBudget& budget)
      : graph_(graph), starts_(std::move(starts)), budget_(budget) {}

  /// Searches for a plan with at most this many expansions, within the budget; another call continues. True
  /// once finished: a plan is found or the graph exhausted.
  bool find(std::size_t expansions) {
    if (best_.exhausted || !best_.path.empty()) return true;
    allowed_ = std::min(expansions, budget_.expansions);
    const auto guide = [&](NodeId node) { return graph_.guide(node); };
    if (pass_ == 0) begin(first_weight, guide);
    const Ended ended = go_on(first_weight, guide, true);
    best_.exhausted = ended == Ended::exhausted;
    return ended != Ended::budget;
  }

  /// Uses up the budget; returns the best plan, or none.
  const SearchOutcome& run() {
    if (!find(budget_.expansions) || best_.exhausted) return best_;
    allowed_ = best_.expansions + budget_.improving;
    const auto guide = [&](NodeId node) { return graph_.guide(node); };
    const auto bound = [&](NodeId node) { return graph_.bound(node); };
    begin(1.3, guide);
    go_on(1.3, guide, false);
    begin(1, bound);
    if (go_on(1, bound, false) != Ended::budget) best_.lower_bound = best_.cost;
    return best_;
  }

  const SearchOutcome& so_far() const { return best_; }
  /// The remaining budget, if no plan was found.
  PlanBudget left() const { return {budget_.expansions - best_.expansions, budget_.improving, time_left()}; }

 private:
  std::optional<double> time_left() const {
    if (!budget_.time_s) return {};
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
    return std::max(0.0, *budget_.time_s - spent.count());
  }
  static constexpr double first_weight = 2;
  enum class Ended { goal, exhausted, budget };
  struct Entry {
    double f = 0, g = 0;
    std::uint64_t sequence = 0;
    NodeId node = no_node, parent = no_node;
    std::uint32_t step = 0;  ///< of the parent's
    bool end = false;
    /// On equal f the one with larger g, then the older: no order depends on addresses or ids.
    bool operator<(const Entry& other) const {
      if (f != other.f) return f > other.f;
      if (g != other.g) return g < other.g;
      return sequence > other.sequence;
    }
  };
  struct Mark {
    std::uint32_t pass = 0;
    NodeId parent = no_node;
  };

  bool spent() const { return best_.expansions >= allowed_ || time_left() == 0.0; }

  template <class Estimate>
  void begin(double weight, const Estimate& estimate) {
    ++pass_;
    queue_ = {};
    sequence_ = 0;
    for (const NodeId node : starts_) push(node, no_node, 0, 0, weight, estimate);
  }

  template <class Estimate>
  Ended go_on(double weight, const Estimate& estimate, bool remember) {
    while (!queue_.empty()) {
      geometry::end_if_interrupted();
      const Entry top = queue_.top();
      if (weight == 1) best_.lower_bound = std::max(best_.lower_bound, std::min(top.f, best_.cost));
      queue_.pop();
      if (!top.end && settled(top.node)) continue;
      if (top.parent != no_node && !graph_.passable(top.parent, top.step)) continue;
      if (top.end) {
        take(top);
        return Ended::goal;
      }
      if (spent()) {
        queue_.push(top);
        return Ended::budget;
      }
      ++best_.expansions;
      if (remember) best_.expanded.push_back(top.node);
      mark(top.node) = {pass_, top.parent};
      const std::vector<StepEdge>& steps = graph_.steps(top.node);
      for (std::uint32_t i = 0; i < steps.size(); ++i)
        if (steps[i].collision != StepEdge::Collision::blocked)
          push(steps[i].to, top.node, i, top.g + steps[i].cost, weight, estimate);
    }
    return Ended::exhausted;
  }

  template <class Estimate>
  void push(NodeId node, NodeId parent, std::uint32_t step, double g, double weight,
            const Estimate& estimate) {
    const bool end = parent != no_node && graph_.ends(parent, node);
    if (!end && settled(node)) return;
    const double bound = end ? 0 : graph_.bound(node);
    if (!(g + bound < best_.cost - 1e-9)) return;
    const double h = end ? 0 : estimate(node);
    if (h == std::numeric_limits<double>::infinity()) return;
    queue_.push({g + weight * h, g, sequence_++, node, parent, step, end});
  }

  Mark& mark(NodeId node) {
    if (node >= marks_.size()) marks_.resize(std::max<std::size_t>(node + 1, graph_.node_count()));
    return marks_[node];
  }
  bool settled(NodeId node) { return mark(node).pass == pass_; }

  void take(const Entry& end) {
    best_.cost = end.g;
    best_.path.assign(1, end.node);
    for (NodeId node = end.parent; node != no_node; node = mark(node).parent) best_.path.push_back(node);
    std::reverse(best_.path.begin(), best_.path.end());
  }

  Graph& graph_;
  std::vector<NodeId> starts_;
  PlanBudget budget_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::size_t allowed_ = 0;
  std::uint32_t pass_ = 0;
  std::uint64_t sequence_ = 0;
  std::priority_queue<Entry> queue_;
  std::vector<Mark> marks_;
  SearchOutcome best_;
};

}  // namespace octosurf::footsteps
