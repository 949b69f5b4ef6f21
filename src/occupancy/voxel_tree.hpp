#pragma once

#include "occupancy/voxel_node.hpp"

#include <octomap/OccupancyOcTreeBase.h>
#include <string>

namespace octosurf {

/// OctoMap's occupancy octree with our nodes. The members made public are what batched insertion
/// and the map file need; OctoMap keeps them for derived classes.
class VoxelTree : public octomap::OccupancyOcTreeBase<VoxelNode> {
 public:
  explicit VoxelTree(double edge) : octomap::OccupancyOcTreeBase<VoxelNode>(edge) {}

  VoxelTree* create() const override { return new VoxelTree(resolution); }
  std::string getTreeType() const override { return "OctosurfTree"; }

  VoxelNode* mutable_root() { return root; }
  VoxelNode* make_root() {
    if (root == nullptr) {
      root = new VoxelNode();
      ++tree_size;
      size_changed = true;
    }
    return root;
  }
};

}  // namespace octosurf
