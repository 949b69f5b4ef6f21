#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace octosurf::geometry {

/// Disjoint sets of the numbers 0 … size − 1 (union-find). A set is identified by one member, its root.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size = 0) : parents_(size) {
    std::iota(parents_.begin(), parents_.end(), std::size_t{0});
  }

  std::size_t size() const { return parents_.size(); }
  /// Adds a set of one.
  void add() { parents_.push_back(parents_.size()); }
  std::size_t root(std::size_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  /// The root of `into`'s set is that of both from now on.
  void join(std::size_t into, std::size_t from) { parents_[root(from)] = root(into); }

 private:
  std::vector<std::size_t> parents_;
};

}  // namespace octosurf::geometry
