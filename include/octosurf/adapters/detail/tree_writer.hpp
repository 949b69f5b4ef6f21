#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <octomap/OccupancyOcTreeBase.h>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/detail/scan_rays.hpp>
#include <octosurf/occupancy.hpp>

// Writes into any OctoMap octree in one recursive descent: every node on the way is visited once, created,
// changed, then pruned or refreshed once on the way back.

namespace octosurf::detail {

/// A node on the way down. One without children stands for eight equal ones, unless it was created on this
/// way.
template <class Tree>
struct TreePlace {
  typename Tree::NodeType* node;
  bool created;
};

/// The root, created if the tree is empty: OctoMap does so only with a voxel or when reading one.
template <class Tree>
TreePlace<Tree> root_of(Tree& tree) {
  const bool empty = tree.getRoot() == nullptr;
  if (empty) {
    // Zeros for all fields that a node may have, and no children.
    std::istringstream zeros(std::string(256, '\0'));
    tree.readData(zeros);
    tree.getRoot()->copyData(typename Tree::NodeType());
  }
  return {tree.getRoot(), empty};
}

template <class Tree>
TreePlace<Tree> child_of(Tree& tree, TreePlace<Tree> place, unsigned child) {
  if (!place.created && !tree.nodeHasChildren(place.node)) tree.expandNode(place.node);
  if (tree.nodeChildExists(place.node, child)) return {tree.getNodeChild(place.node, child), false};
  return {tree.createNodeChild(place.node, child), true};
}

template <class Tree>
void close_node(Tree& tree, typename Tree::NodeType* node) {
  if (!tree.pruneNode(node)) node->updateOccupancyChildren();
}

/// Applies a scan's hits and misses. Equals OctoMap's `updateNode` voxel by voxel, because a voxel occurs at
/// most once in a batch.
template <class Tree>
class BatchInsert {
 public:
  BatchInsert(Tree& tree, bool lazy)
      : tree_(tree),
        lazy_(lazy),
        hit_(tree.getProbHitLog()),
        miss_(tree.getProbMissLog()),
        clamp_min_(tree.getClampingThresMinLog()),
        clamp_max_(tree.getClampingThresMaxLog()) {}

  /// Blocks in ascending Morton order.
  void operator()(std::span<const TouchedBlock> blocks) {
    if (!blocks.empty()) descend(root_of(tree_), block_depth, blocks);
  }

 private:
  using Place = TreePlace<Tree>;
  static constexpr int block_depth = 13;  // levels from the root to an 8³ block

  void descend(Place place, int levels, std::span<const TouchedBlock> blocks) {
    if (settled(place, any_hit(blocks), true)) return;
    if (levels == 0) {
      const TouchedBlock& block = blocks.front();
      for (unsigned c = 0; c < 8; ++c)
        if ((block.hits[c] | block.misses[c]) != 0)
          update<2>(child_of(tree_, place, c), block.hits[c], block.misses[c]);
    } else {
      for_each_touched_child(blocks, 3 * (levels - 1),
                             [&](unsigned child, std::span<const TouchedBlock> below) {
                               descend(child_of(tree_, place, child), levels - 1, below);
                             });
    }
    close(place.node);
  }

  /// A cube of 2^level voxels, a bit of the masks each: 4³ are one word, 2³ one byte of it.
  template <int level>
  void update(Place place, std::uint64_t hits, std::uint64_t misses) {
    if constexpr (level == 0) {
      tree_.updateNodeLogOdds(place.node, hits != 0 ? hit_ : miss_);
    } else {
      if (settled(place, hits != 0, misses != 0)) return;
      constexpr unsigned bits = 1U << (3 * (level - 1));
      constexpr std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
      for (unsigned c = 0; c < 8; ++c)
        if (((hits | misses) >> (bits * c) & mask) != 0)
          update<level - 1>(child_of(tree_, place, c), hits >> (bits * c) & mask,
                            misses >> (bits * c) & mask);
      close(place.node);
    }
  }

  /// Nothing below a leaf at the clamp can change: OctoMap's early abort.
  bool settled(Place place, bool hit, bool miss) const {
    return !place.created && !tree_.nodeHasChildren(place.node) &&
           (!hit || place.node->getLogOdds() >= clamp_max_) &&
           (!miss || place.node->getLogOdds() <= clamp_min_);
  }

  void close(typename Tree::NodeType* node) {
    if (!lazy_) close_node(tree_, node);
  }

  Tree& tree_;
  bool lazy_;
  float hit_, miss_, clamp_min_, clamp_max_;
};

/// Replaces cubes, added in Morton order, by leaves; unchanged nodes are kept.
template <class Tree>
class LeafInsert {
 public:
  explicit LeafInsert(Tree& tree) : tree_(tree) {}

  void add(const std::array<std::uint16_t, 3>& corner, std::uint8_t level,
           std::span<const OccupancyView::Leaf> leaves) {
    leaves_.insert(leaves_.end(), leaves.begin(), leaves.end());
    cubes_.push_back({key_of(corner), level, leaves.size()});
  }

  /// `leaves` of the whole tree, in Morton order.
  void replace_all(std::vector<OccupancyView::Leaf> leaves) {
    cubes_ = {{{0, 0, 0}, 16, leaves.size()}};
    leaves_ = std::move(leaves);
    finish();
  }

  /// Call after the last change.
  void finish() {
    next_ = leaves_.data();
    if (!cubes_.empty() && !replace(root_of(tree_), 16, cubes_)) tree_.clear();
  }

 private:
  using Node = typename Tree::NodeType;
  using Leaves = std::span<const OccupancyView::Leaf>;
  struct Cube {
    octomap::OcTreeKey key;
    int level;
    std::size_t leaves;  ///< none: it became unknown
  };

  static octomap::OcTreeKey key_of(const std::array<std::uint16_t, 3>& corner) {
    return {corner[0], corner[1], corner[2]};
  }

  /// False if nothing is known below the node any longer.
  bool replace(TreePlace<Tree> place, int level, std::span<const Cube> cubes) {
    if (cubes.front().level == level) {
      const Leaves leaves(next_, cubes.front().leaves);
      next_ += leaves.size();
      if (!leaves.empty()) write(place.node, level, leaves);
      return !leaves.empty();
    }
    while (!cubes.empty()) {
      const unsigned c = octomap::computeChildIdx(cubes.front().key, level - 1);
      std::size_t n = 1;
      while (n < cubes.size() && octomap::computeChildIdx(cubes[n].key, level - 1) == c) ++n;
      const TreePlace<Tree> child = child_of(tree_, place, c);
      place.created = true;  // now divided, whatever is removed
      if (!replace(child, level - 1, cubes.first(n))) remove_child(place.node, c);
      cubes = cubes.subspan(n);
    }
    if (!tree_.nodeHasChildren(place.node)) return false;
    close_node(tree_, place.node);
    return true;
  }

  /// Replaces the node's contents by `leaves`, which are all of its cube; returns its value, their maximum.
  float write(Node* node, int level, Leaves leaves) {
    float largest = -std::numeric_limits<float>::infinity();
    if (leaves.front().level == level) {
      if (tree_.nodeHasChildren(node)) make_leaf(node);
      largest = leaves.front().log_odds;
      leaves = {};
    } else {
      for (unsigned c = 0; c < 8; ++c) {
        const auto beyond = std::partition_point(leaves.begin(), leaves.end(), [&](const auto& leaf) {
          return octomap::computeChildIdx(key_of(leaf.corner), level - 1) == c;
        });
        const Leaves inside(leaves.begin(), beyond);
        leaves = Leaves(beyond, leaves.end());
        if (inside.empty())
          remove_child(node, c);
        else
          largest = std::max(largest, write(child_of(tree_, {node, true}, c).node, level - 1, inside));
      }
    }
    node->setLogOdds(largest);
    return largest;
  }

  /// Removes the child and its subtree, if it exists.
  void remove_child(Node* node, unsigned child) {
    if (!tree_.nodeChildExists(node, child)) return;
    make_leaf(tree_.getNodeChild(node, child));
    tree_.deleteNodeChild(node, child);
  }

  /// Pruning is OctoMap's only public way to remove a node's children and free their table, and it requires
  /// eight equal ones.
  void make_leaf(Node* node) {
    for (unsigned c = 0; c < 8; ++c) {
      if (!tree_.nodeChildExists(node, c))
        tree_.createNodeChild(node, c);
      else if (Node* child = tree_.getNodeChild(node, c); tree_.nodeHasChildren(child))
        make_leaf(child);
      tree_.getNodeChild(node, c)->setLogOdds(0);
    }
    tree_.pruneNode(node);
  }

  Tree& tree_;
  std::vector<Cube> cubes_;
  std::vector<OccupancyView::Leaf> leaves_;
  const OccupancyView::Leaf* next_ = nullptr;  // of the next cube
};

}  // namespace octosurf::detail
