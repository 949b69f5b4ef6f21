#pragma once

#include "planning/voxel_matter.hpp"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <octosurf/occupancy.hpp>

namespace octosurf::footsteps {

/// An upright box in the walking frame (z is up), rotated about z.
struct UprightBox {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
  double half_length = 0, half_width = 0;
  double from_z = 0, to_z = 0;                     ///< over its middle
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();  ///< slope of its bottom and top, m along x and y
};

/// The octree's occupied voxels, sorted into columns of the walking frame, tile by tile on demand: a box test
/// takes about a microsecond, against twenty with the octree.
///
/// Contents of voxels (voxel_matter.hpp) are expanded to their extent along the box's sides, so a free box is
/// free of them in any orientation.
class ObstacleColumns {
 public:
  /// Uses voxels between `low` and `high` (walking frame) only; keeps `surfaces`, as MatterOfVoxels'.
  ObstacleColumns(OccupancyView octree, std::shared_ptr<const Snapshot> surfaces,
                  const Eigen::Matrix3d& R_walk_map, double low, double high);

  /// Whether the box contains something occupied that is not of surface `but`: distant readings of a floor
  /// scatter over it.
  bool blocked(const UprightBox& box, SurfaceId but = 0);

  /// Takes over the tiles near which neither voxels nor surfaces have changed since.
  void follow(const ObstacleColumns& before);

 private:
  static constexpr int tile_pixels = 32, block_pixels = 4, tile_blocks = tile_pixels / block_pixels;
  struct Voxel {
    std::uint32_t column;
    float z;  ///< of its matter's middle
    SurfaceId surface;
    planning::VoxelMatter matter;  ///< its middle in the walking frame
  };
  struct Tile {
    std::vector<std::uint32_t> begin;  ///< tile_pixels² + 1 positions in voxels
    std::vector<Voxel> voxels;         ///< by column, ascending in z
    std::vector<float> top;            ///< the highest of each block of block_pixels² columns
  };
  /// An upright box in pixel coordinates, with precomputed values.
  struct Sought {
    UprightBox box;
    Eigen::Vector2d ahead, left;  ///< its sides' directions
    Eigen::Vector3d ahead_in_map, left_in_map, over_bottom_in_map;
    double half_length, half_width;  ///< enlarged by the extent of voxel contents, and half a pixel
    float from_z, to_z;              ///< likewise
    SurfaceId but;
    int x0, x1, y0, y1;  ///< pixels
  };
  bool reaches(const planning::VoxelMatter& matter, const Sought& sought) const;
  bool blocked_in_block(const Tile& tile, int x, int y, const Sought& sought) const;
  const Tile& tile(int tile_x, int tile_y);
  Tile load(int tile_x, int tile_y) const;

  OccupancyView octree_;
  std::shared_ptr<const Snapshot> surfaces_;
  Eigen::Matrix3d R_walk_map_;
  double low_, high_, pixel_;
  std::unordered_map<std::uint64_t, Tile> tiles_;  ///< references to tiles stay valid
  /// The last tile for each place in a square of 8 × 8: consecutive queries are nearby, and hash look-ups
  /// took a seventh of a search.
  struct Recent {
    std::uint64_t key = 0;
    const Tile* tile = nullptr;
  };
  std::array<Recent, 64> recent_{};
};

}  // namespace octosurf::footsteps
