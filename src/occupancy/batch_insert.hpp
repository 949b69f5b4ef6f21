#pragma once

#include "occupancy/frame_bits.hpp"
#include "occupancy/morton.hpp"
#include "occupancy/voxel_key.hpp"

#include <cstdint>
#include <span>

namespace octosurf {

/// Applies a scan's hits and misses to an OctoMap occupancy tree in one recursive descent over the
/// touched blocks: every node on the way is visited once, created, updated, then pruned or
/// refreshed once on the way back. The result equals updating voxel by voxel (OctoMap's
/// `updateNode`, not lazy), because a voxel occurs at most once in a batch.
///
/// Policy: `bool keep(Node&, VoxelKey)` is asked before a miss at an existing leaf of the lowest
/// level (true: the miss does not count); `void changed(Node&, VoxelKey, bool hit, bool was_occupied)`
/// is told of every updated leaf.
template <class Tree, class Policy>
class BatchInsert {
 public:
  using Node = typename Tree::NodeType;

  BatchInsert(Tree& tree, Policy& policy)
      : tree_(tree),
        policy_(policy),
        hit_(tree.getProbHitLog()),
        miss_(tree.getProbMissLog()),
        clamp_min_(tree.getClampingThresMinLog()),
        clamp_max_(tree.getClampingThresMaxLog()) {}

  /// `root` exists; `created` if just now. Blocks in ascending Morton order.
  void operator()(Node* root, bool created, std::span<const TouchedBlock> blocks) {
    if (!blocks.empty()) descend(root, created, block_depth, blocks);
  }

 private:
  static constexpr int block_depth = 13;  // levels from the root to an 8³ block

  void descend(Node* node, bool created, int levels, std::span<const TouchedBlock> blocks) {
    if (levels == 0) {
      update_block(node, created, blocks.front());
      return;
    }
    const int shift = 3 * (levels - 1);
    for (std::size_t begin = 0; begin < blocks.size();) {
      const auto child = static_cast<unsigned>(blocks[begin].morton >> shift & 7);
      std::size_t end = begin + 1;
      while (end < blocks.size() && (blocks[end].morton >> shift & 7) == child) ++end;
      const auto [next, fresh] = child_of(node, created, child);
      descend(next, fresh, levels - 1, blocks.subspan(begin, end - begin));
      begin = end;
    }
    close(node);
  }

  void update_block(Node* node, bool created, const TouchedBlock& block) {
    if (saturated(node, created)) {
      std::uint64_t hits = 0;
      for (const std::uint64_t w : block.hits) hits |= w;
      if (hits == 0) return;
    }
    for (unsigned c = 0; c < 8; ++c) {
      if ((block.hits[c] | block.misses[c]) == 0) continue;
      const auto [next, fresh] = child_of(node, created, c);
      update_octant(next, fresh, block, c);
    }
    close(node);
  }

  // 4³ voxels: one word of the masks.
  void update_octant(Node* node, bool created, const TouchedBlock& block, unsigned word) {
    const std::uint64_t hits = block.hits[word], misses = block.misses[word];
    if (hits == 0 && saturated(node, created)) return;
    for (unsigned c = 0; c < 8; ++c) {
      if (((hits | misses) >> (8 * c) & 0xff) == 0) continue;
      const auto [next, fresh] = child_of(node, created, c);
      update_leaves(next, fresh, block, 64 * word + 8 * c, hits >> (8 * c) & 0xff, misses >> (8 * c) & 0xff);
    }
    close(node);
  }

  // 2³ voxels: one byte of the masks.
  void update_leaves(Node* node, bool created, const TouchedBlock& block, unsigned first, std::uint64_t hits,
                     std::uint64_t misses) {
    if (hits == 0 && saturated(node, created)) return;
    for (unsigned c = 0; c < 8; ++c) {
      const bool hit = hits >> c & 1;
      if (!hit && !(misses >> c & 1)) continue;
      const auto [leaf, fresh] = child_of(node, created, c);
      update_leaf(*leaf, fresh, hit, key_of(block.morton, first + c));
    }
    close(node);
  }

  void update_leaf(Node& leaf, bool fresh, bool hit, VoxelKey key) {
    if (!hit && !fresh && policy_.keep(leaf, key)) return;
    const bool was_occupied = !fresh && tree_.isNodeOccupied(leaf);
    const float value = leaf.getLogOdds() + (hit ? hit_ : miss_);
    leaf.setLogOdds(value < clamp_min_ ? clamp_min_ : value > clamp_max_ ? clamp_max_ : value);
    policy_.changed(leaf, key, hit, was_occupied);
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

  /// Free to the clamp and undivided: misses cannot change anything below.
  bool saturated(const Node* node, bool created) const {
    return !created && node->getLogOdds() <= clamp_min_ && !tree_.nodeHasChildren(node);
  }

  void close(Node* node) {
    if (!tree_.pruneNode(node)) node->updateOccupancyChildren();
  }

  static VoxelKey key_of(std::uint64_t block_morton, unsigned index) {
    const BlockOffset o = block_offset(index);
    return {static_cast<std::uint16_t>(compact_bits(block_morton) * 8 + o.x),
            static_cast<std::uint16_t>(compact_bits(block_morton >> 1) * 8 + o.y),
            static_cast<std::uint16_t>(compact_bits(block_morton >> 2) * 8 + o.z)};
  }

  Tree& tree_;
  Policy& policy_;
  float hit_, miss_, clamp_min_, clamp_max_;
};

}  // namespace octosurf
