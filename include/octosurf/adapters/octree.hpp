#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <octomap/OcTree.h>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/detail/tree_writer.hpp>
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

inline Eigen::AlignedBox3d everywhere() {
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  return {-far, far};
}

/// Exact: converting a float's log-odds to a probability and back in doubles is lossless.
inline void set_threshold(octomap::OcTree& tree, const OccupancyView& view) {
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
  std::vector<OccupancyView::Leaf> all;
  view.for_each_leaf(box, [&](std::span<const OccupancyView::Leaf> leaves) {
    all.insert(all.end(), leaves.begin(), leaves.end());
  });
  detail::LeafInsert<octomap::OcTree>(*tree).replace_all(std::move(all));
  return tree;
}

/// Updates a tree that equals to_octree(before) to to_octree(now), node by node. Both are views of one map.
/// Cost: some 2 ms for 4,000 changed cubes of 2³ voxels among a million leaves, a twentieth of building the
/// tree anew. Half of it is for_each_change().
inline void update_octree(octomap::OcTree& tree, const OccupancyView& before, const OccupancyView& now) {
  for (const OccupancyView* view : {&before, &now})
    if (view->resolution() > 0 && tree.getResolution() != view->resolution())
      throw Error(Error::Kind::usage, "update_octree", "the octree's resolution is not the map's",
                  "make it with " + std::to_string(view->resolution()) + " m");
  detail::set_threshold(tree, now);
  detail::LeafInsert<octomap::OcTree> insert(tree);
  now.for_each_change(before, [&](const auto&... change) { insert.add(change...); });
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
