#pragma once

#include "geometry/voxel_grid.hpp"
#include "occupancy/voxel_tree.hpp"
#include "sensing/reading_code.hpp"

#include <octosurf/occupancy.hpp>

namespace octosurf::test {

/// An octree put together voxel by voxel, with OctoMap's default model.
class PaintedOctree {
 public:
  explicit PaintedOctree(double resolution)
      : resolution_(resolution), tree_(occupancy::OccupancyModel{0.85F, -0.4F, -2, 3.5F, 0}) {}

  /// The voxel whose corner is (x, y, z) times the resolution.
  void occupy(int x, int y, int z, float log_odds, SurfaceId surface) {
    const geometry::VoxelKey key = key_of(x, y, z);
    tree_.set_leaf(key, 0, log_odds);
    occupancy::VoxelPayload& payload = tree_.make_payload(key);
    payload.surface = surface & 0xFFFFFFU;
    payload.range_class = 1;
    payload.offset_x = payload.offset_y = payload.offset_z = 128;
    payload.view = sensing::encode_view(Eigen::Vector3f::UnitZ()) & 0xfff;
  }
  /// A cube of 2^level voxels.
  void free(int x, int y, int z, int level = 0) { tree_.set_leaf(key_of(x, y, z), level, -1); }

  OccupancyView view() { return {tree_.share(), resolution_}; }

 private:
  static geometry::VoxelKey key_of(int x, int y, int z) {
    const auto key = [](int i) { return static_cast<std::uint16_t>(geometry::VoxelGrid::origin + i); };
    return {key(x), key(y), key(z)};
  }

  double resolution_;
  occupancy::VoxelTree tree_;
};

}  // namespace octosurf::test
