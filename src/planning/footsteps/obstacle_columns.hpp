#pragma once

#include "planning/voxel_matter.hpp"

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <octosurf/occupancy.hpp>

namespace octosurf::footsteps {

/// A box that stands upright in the walking frame (z is up), turned about z.
struct UprightBox {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
  double half_length = 0, half_width = 0;
  double from_z = 0, to_z = 0;                     ///< over its middle
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();  ///< by which its bottom and top rise, m along x and y
};

/// The octree's occupied voxels, sorted into columns of the walking frame, tile by tile as they are asked
/// for: a box is tested in about a microsecond, where the octree itself takes twenty.
///
/// What voxels hold (voxel_matter.hpp) counts as far as it reaches along the box's sides, so a box that is
/// free is free of it, however the walking frame is turned.
class ObstacleColumns {
 public:
  /// Only voxels between `low` and `high` (walking frame) are looked at; `surfaces` as MatterOfVoxels', kept.
  ObstacleColumns(OccupancyView octree, std::shared_ptr<const Snapshot> surfaces,
                  const Eigen::Matrix3d& R_walk_map, double low, double high);

  /// Something occupied is in the box that is not of surface `but`: far readings of a floor scatter over it.
  bool blocked(const UprightBox& box, SurfaceId but = 0);

  double load_ms() const { return load_ms_; }  ///< spent on tiles so far

 private:
  static constexpr int tile_pixels = 32, block_pixels = 4, tile_blocks = tile_pixels / block_pixels;
  struct Tile {
    std::vector<std::uint32_t> begin;           ///< tile_pixels² + 1 positions in z
    std::vector<float> z;                       ///< of the matter's middle, ascending in a column
    std::vector<SurfaceId> surface;             ///< whose voxel, for each z
    std::vector<planning::VoxelMatter> matter;  ///< for each z; its middle in the walking frame
    std::vector<float> top;                     ///< the highest of each block of block_pixels² columns
  };
  /// An upright box as pixels see it, and what of it they need not work out anew.
  struct Sought {
    UprightBox box;
    Eigen::Vector2d ahead, left;  ///< its sides' directions
    Eigen::Vector3d ahead_in_map, left_in_map, over_bottom_in_map;
    double half_length, half_width;  ///< with room for the middle of what reaches in, and for a pixel's half
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
  std::unordered_map<std::uint64_t, Tile> tiles_;  ///< its tiles stay where they are
  /// The tile of each place in a square of 8 × 8 that was asked for last: a robot's steps are asked about
  /// side by side, and looking a tile up took a seventh of a search.
  struct Recent {
    std::uint64_t key = 0;
    const Tile* tile = nullptr;
  };
  std::array<Recent, 64> recent_{};
  double load_ms_ = 0;
};

}  // namespace octosurf::footsteps
