#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <octomap/OcTree.h>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/occupancy.hpp>

// Converts a map's octree to octomap::OcTree, as MoveIt, FCL and others use it, updates it, and converts
// back. Needs OctoMap's headers and library besides octosurf::octosurf.
//
//   const std::unique_ptr<octomap::OcTree> tree = octosurf::to_octree(map.octree());
//   octosurf::OccupancyView before = map.octree();
//   …                                                 // scans
//   octosurf::update_octree(*tree, before, map.octree());

namespace octosurf {
namespace detail {

/// Creates the nodes below one node of an OctoMap octree from leaves in Morton order, without lookups; inner
/// nodes get their maximum when their last child is complete.
template <class Tree>
class LeafBuilder {
 public:
  using Node = typename Tree::NodeType;

  /// `top`, of edge 2^level voxels, has no children and keeps its value if no leaf is added.
  LeafBuilder(Tree& tree, Node* top, int level) : tree_(tree), top_(level) { path_[index(level)] = top; }

  void add(const OccupancyView::Leaf& leaf) {
    const int from = closed_to(leaf);
    for (int level = from; level > leaf.level; --level) {
      path_[index(level - 1)] = tree_.createNodeChild(path_[index(level)], child_of(leaf.corner, level - 1));
      largest_[index(level - 1)] = -std::numeric_limits<float>::infinity();
    }
    path_[index(leaf.level)]->setLogOdds(leaf.log_odds);
    largest_[index(leaf.level)] = leaf.log_odds;
    last_ = leaf;
    any_ = true;
  }

  void finish() {
    if (any_) close(top_);
  }

 private:
  static std::size_t index(int level) { return static_cast<std::size_t>(level); }
  static unsigned child_of(const std::array<std::uint16_t, 3>& key, int level) {
    return (key[0] >> level & 1U) | (key[1] >> level & 1U) << 1 | (key[2] >> level & 1U) << 2;
  }

  /// Level of the common ancestor of this leaf and the previous one; all nodes below it are complete.
  int closed_to(const OccupancyView::Leaf& leaf) {
    if (!any_) return top_;
    unsigned different = 0;
    for (std::size_t i = 0; i < 3; ++i) different |= static_cast<unsigned>(leaf.corner[i] ^ last_.corner[i]);
    const int common = std::bit_width(different);
    close(common);
    return common;
  }
  /// Sets the values of the last leaf's ancestors below `level`.
  void close(int level) {
    for (int l = last_.level; l < level; ++l) {
      float& above = largest_[index(l + 1)];
      above = std::max(above, largest_[index(l)]);
      path_[index(l + 1)]->setLogOdds(above);
    }
  }

  Tree& tree_;
  int top_;
  std::array<Node*, 17> path_{};
  std::array<float, 17> largest_ = [] {
    std::array<float, 17> none{};
    none.fill(-std::numeric_limits<float>::infinity());
    return none;
  }();
  OccupancyView::Leaf last_;
  bool any_ = false;
};

/// OctoMap creates a root only with a voxel or when reading one: log-odds and no children.
template <class Tree>
void make_empty_root(Tree& tree) {
  std::istringstream root(std::string(sizeof(float) + 1, '\0'));
  tree.readData(root);
}

/// Writes changed cubes, which come in Morton order, into a tree: unchanged nodes are kept, and ancestors
/// shared by several cubes are found and refreshed once.
template <class Tree>
class ChangeInsert {
 public:
  using Node = typename Tree::NodeType;
  using Leaves = std::span<const OccupancyView::Leaf>;

  explicit ChangeInsert(Tree& tree) : tree_(tree) {}

  void operator()(const OccupancyView::Change& change) {
    const octomap::OcTreeKey key(change.corner[0], change.corner[1], change.corner[2]);
    const bool gone = change.leaves.empty();
    if (gone && change.level == 16) return tree_.clear();
    descend(key, gone ? change.level + 1 : change.level);
    if (gone)
      remove_child(path_[at(change.level + 1)], octomap::computeChildIdx(key, change.level));
    else
      write(path_[at(change.level)], change.level, change.leaves);
    last_ = key;
    stale_ = change.level + 1;
    open_ = true;
  }

  /// Call after the last change.
  void finish() {
    if (open_) close(17);
    open_ = false;
  }

 private:
  static std::size_t at(int level) { return static_cast<std::size_t>(level); }

  /// Descends path_ to the node of `key` at `level`.
  void descend(const octomap::OcTreeKey& key, int level) {
    int from = 16;
    if (open_) {
      unsigned different = 0;
      for (unsigned i = 0; i < 3; ++i) different |= static_cast<unsigned>(key[i] ^ last_[i]);
      from = std::bit_width(different);
      close(from);
    } else {
      const bool empty = tree_.getRoot() == nullptr;
      if (empty) make_empty_root(tree_);
      path_[16] = tree_.getRoot();
      divided_[16] = empty || tree_.nodeHasChildren(path_[16]);
    }
    for (int l = from; l > level; --l) path_[at(l - 1)] = child_of(l, octomap::computeChildIdx(key, l - 1));
  }

  Node* child_of(int level, unsigned child) {
    Node* node = path_[at(level)];
    if (!divided_[at(level)]) tree_.expandNode(node);  // a leaf represents eight equal children
    divided_[at(level)] = true;
    const bool exists = tree_.nodeChildExists(node, child);
    Node* next = exists ? tree_.getNodeChild(node, child) : tree_.createNodeChild(node, child);
    divided_[at(level - 1)] = !exists || tree_.nodeHasChildren(next);
    return next;
  }

  /// Refreshes the path's nodes above the last cube and below `level`; no further change falls into them.
  void close(int level) {
    for (int l = stale_; l < level; ++l) {
      Node* node = path_[at(l)];
      if (tree_.nodeHasChildren(node)) {
        if (!tree_.pruneNode(node)) node->updateOccupancyChildren();
      } else if (l == 16) {
        tree_.clear();
      } else {
        remove_child(path_[at(l + 1)], octomap::computeChildIdx(last_, l));
      }
    }
  }

  /// Replaces the node's contents by `leaves`, which are all of its cube; returns its value, their maximum.
  float write(Node* node, int level, Leaves leaves) {
    if (leaves.front().level == level) return write_leaf(node, leaves.front());
    float largest = -std::numeric_limits<float>::infinity();
    if (level == 1 && leaves.size() == 8) {  // the common case
      for (unsigned c = 0; c < 8; ++c) largest = std::max(largest, write_leaf(child_at(node, c), leaves[c]));
      node->setLogOdds(largest);
      return largest;
    }
    for (unsigned c = 0; c < 8; ++c) {
      const auto beyond = std::find_if(leaves.begin(), leaves.end(), [&](const OccupancyView::Leaf& leaf) {
        return octomap::computeChildIdx({leaf.corner[0], leaf.corner[1], leaf.corner[2]}, level - 1) != c;
      });
      const Leaves inside(leaves.begin(), beyond);
      leaves = Leaves(beyond, leaves.end());
      if (inside.empty()) {
        remove_child(node, c);
        continue;
      }
      largest = std::max(largest, write(child_at(node, c), level - 1, inside));
    }
    node->setLogOdds(largest);
    return largest;
  }

  Node* child_at(Node* node, unsigned c) {
    return tree_.nodeChildExists(node, c) ? tree_.getNodeChild(node, c) : tree_.createNodeChild(node, c);
  }

  float write_leaf(Node* node, const OccupancyView::Leaf& leaf) {
    if (tree_.nodeHasChildren(node)) make_leaf(node);
    node->setLogOdds(leaf.log_odds);
    return leaf.log_odds;
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
  std::array<Node*, 17> path_{};
  std::array<bool, 17> divided_{};  ///< for the path's nodes: without children they are unknown
  octomap::OcTreeKey last_;
  int stale_ = 17;  ///< lowest level of the path that needs a refresh
  bool open_ = false;
};

inline Eigen::AlignedBox3d everywhere() {
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  return {-far, far};
}

template <class Tree>
void require_resolution(const Tree& tree, const OccupancyView& view, const char* where) {
  if (view.resolution() > 0 && tree.getResolution() != view.resolution())
    throw Error(Error::Kind::usage, where, "the octree's resolution is not the map's",
                "make it with " + std::to_string(view.resolution()) + " m");
}

/// Exact: converting a float's log-odds to a probability and back in doubles is lossless.
template <class Tree>
void set_threshold(Tree& tree, const OccupancyView& view) {
  if (view.resolution() > 0) tree.setOccupancyThres(octomap::probability(view.occupied_from()));
}

}  // namespace detail

/// The octree of `view` (Map::octree(), Snapshot::octree), or the part that meets `box`.
///
/// 1. Leaf by leaf equal to the tree of OctoMap's insertPointCloud for the same scans, if the map was built
///    without `preserve_surfaces`: values, pruning, inner nodes.
/// 2. With a box, every voxel that meets it has its value; some beside it may too, where the box cuts a
///    pruned cube.
/// The occupancy threshold is the map's. The rest of the occupancy model (hit, miss, clamping) is OctoMap's
/// default: set_model() sets the map's. Cost: some 30 ns a node, mostly OctoMap's allocations; its readBinary
/// takes as long.
inline std::unique_ptr<octomap::OcTree> to_octree(const OccupancyView& view,
                                                  const Eigen::AlignedBox3d& box = detail::everywhere()) {
  if (!(view.resolution() > 0))
    throw Error(Error::Kind::usage, "to_octree", "a view of nothing has no resolution");
  auto tree = std::make_unique<octomap::OcTree>(view.resolution());
  detail::set_threshold(*tree, view);
  std::optional<detail::LeafBuilder<octomap::OcTree>> builder;
  view.for_each_leaf(box, [&](std::span<const OccupancyView::Leaf> leaves) {
    if (!builder) {
      detail::make_empty_root(*tree);
      builder.emplace(*tree, tree->getRoot(), 16);
    }
    for (const OccupancyView::Leaf& leaf : leaves) builder->add(leaf);
  });
  if (builder) builder->finish();
  return tree;
}

/// Updates a tree that equals to_octree(before) to to_octree(now), node by node. Both are views of one map.
/// Cost: some 2 ms for 4,000 changed cubes of 2³ voxels among a million leaves, a twentieth of building the
/// tree anew. Half of it is for_each_change().
inline void update_octree(octomap::OcTree& tree, const OccupancyView& before, const OccupancyView& now) {
  detail::require_resolution(tree, before, "update_octree");
  detail::require_resolution(tree, now, "update_octree");
  detail::set_threshold(tree, now);
  detail::ChangeInsert<octomap::OcTree> insert(tree);
  now.for_each_change(before, [&](const OccupancyView::Change& change) { insert(change); });
  insert.finish();
}

/// Sets the map's occupancy model, so that scans inserted by OctoMap itself count as they do in the map.
inline void set_model(octomap::OcTree& tree, const Parameters& parameters) {
  const OccupancyParameters& model = parameters.occupancy;
  tree.setProbHit(model.hit);
  tree.setProbMiss(model.miss);
  tree.setClampingThresMin(model.clamp_min);
  tree.setClampingThresMax(model.clamp_max);
  tree.setOccupancyThres(model.occupied);
}

/// A map with the octree `tree`, without points or surfaces yet: Mapper::detect_in_occupancy() finds them.
/// The tree's resolution replaces the parameters'. Throws Error(usage) for unsuitable parameters, Error(data)
/// for log-odds that are not finite.
inline Map map_from_octree(const octomap::OcTree& tree, Parameters parameters = {}) {
  parameters.occupancy.resolution = tree.getResolution();
  std::vector<OccupancyView::Leaf> leaves;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const octomap::OcTreeKey corner = leaf.getIndexKey();
    leaves.push_back({{corner[0], corner[1], corner[2]},
                      static_cast<std::uint8_t>(16 - leaf.getDepth()),
                      leaf->getLogOdds()});
  }
  return map_from_leaves(leaves, parameters);
}

}  // namespace octosurf
