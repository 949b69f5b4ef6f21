#pragma once

#include <cstdint>
#include <span>

#include <octosurf/adapters/detail/scan_rays.hpp>

namespace octosurf::detail {

/// Applies a scan's hits and misses to an OctoMap occupancy tree in one recursive descent over the
/// touched blocks: every node on the way is visited once, created, updated, then (not lazy) pruned or
/// refreshed once on the way back. Equals OctoMap's `updateNode` voxel by voxel, because a voxel
/// occurs at most once in a batch.
template <class Tree>
class BatchInsert {
 public:
  using Node = typename Tree::NodeType;

  BatchInsert(Tree& tree, bool lazy)
      : tree_(tree),
        lazy_(lazy),
        hit_(tree.getProbHitLog()),
        miss_(tree.getProbMissLog()),
        clamp_min_(tree.getClampingThresMinLog()),
        clamp_max_(tree.getClampingThresMaxLog()) {}

  /// Blocks in ascending Morton order. The tree has a root.
  void operator()(std::span<const TouchedBlock> blocks) {
    if (!blocks.empty()) descend(tree_.getRoot(), false, block_depth, blocks);
  }

 private:
  static constexpr int block_depth = 13;  // levels from the root to an 8³ block

  void descend(Node* node, bool created, int levels, std::span<const TouchedBlock> blocks) {
    if (levels == 0) return update_block(node, created, blocks.front());
    if (undivided(node, created) && settled(node, any_hit(blocks), true)) return;
    for_each_touched_child(blocks, 3 * (levels - 1),
                           [&](unsigned child, std::span<const TouchedBlock> below) {
                             const auto [next, fresh] = child_of(node, created, child);
                             descend(next, fresh, levels - 1, below);
                           });
    close(node);
  }

  void update_block(Node* node, bool created, const TouchedBlock& block) {
    if (undivided(node, created) && settled(node, block.hit, true)) return;
    for (unsigned c = 0; c < 8; ++c) {
      if ((block.hits[c] | block.misses[c]) == 0) continue;
      const auto [next, fresh] = child_of(node, created, c);
      update_octant(next, fresh, block.hits[c], block.misses[c]);
    }
    close(node);
  }

  // 4³ voxels: one word of the masks.
  void update_octant(Node* node, bool created, std::uint64_t hits, std::uint64_t misses) {
    if (undivided(node, created) && settled(node, hits != 0, misses != 0)) return;
    for (unsigned c = 0; c < 8; ++c) {
      if (((hits | misses) >> (8 * c) & 0xff) == 0) continue;
      const auto [next, fresh] = child_of(node, created, c);
      update_leaves(next, fresh, hits >> (8 * c) & 0xff, misses >> (8 * c) & 0xff);
    }
    close(node);
  }

  // 2³ voxels: one byte of the masks.
  void update_leaves(Node* node, bool created, std::uint64_t hits, std::uint64_t misses) {
    if (undivided(node, created) && settled(node, hits != 0, misses != 0)) return;
    for (unsigned c = 0; c < 8; ++c) {
      const bool hit = hits >> c & 1;
      if (!hit && !(misses >> c & 1)) continue;
      tree_.updateNodeLogOdds(child_of(node, created, c).node, hit ? hit_ : miss_);
    }
    close(node);
  }

  struct Child {
    Node* node;
    bool created;
  };
  Child child_of(Node* node, bool node_created, unsigned child) {
    if (tree_.nodeChildExists(node, child)) return {tree_.getNodeChild(node, child), false};
    // A leaf that is not new stands for eight equal children.
    if (!node_created && !tree_.nodeHasChildren(node)) {
      tree_.expandNode(node);
      return {tree_.getNodeChild(node, child), false};
    }
    return {tree_.createNodeChild(node, child), true};
  }

  bool undivided(const Node* node, bool created) const { return !created && !tree_.nodeHasChildren(node); }

  /// Nothing below a leaf at the clamp can change: OctoMap's early abort.
  bool settled(const Node* node, bool hit, bool miss) const {
    return (!hit || node->getLogOdds() >= clamp_max_) && (!miss || node->getLogOdds() <= clamp_min_);
  }

  void close(Node* node) {
    if (!lazy_ && !tree_.pruneNode(node)) node->updateOccupancyChildren();
  }

  Tree& tree_;
  bool lazy_;
  float hit_, miss_, clamp_min_, clamp_max_;
};

}  // namespace octosurf::detail
