#pragma once

#include "occupancy/downsample.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace octosurf {

/// 8³ voxels that a scan touched: bit m of a mask is the voxel with Morton index m inside the
/// block, so that word w and its bytes are the octree's children and grandchildren.
struct TouchedBlock {
  std::uint64_t morton = 0;  ///< of the block's key (voxel key / 8), 13 bits an axis
  std::array<std::uint64_t, 8> hits{};
  std::array<std::uint64_t, 8> misses{};  ///< never overlap hits
};

/// The voxels one scan hits and misses, as OctoMap's discretised insertion would list them, with
/// no hash of voxels: rays set bits in a linear bit set over the frame's bounding box (x fastest,
/// rows of whole words), so that a step costs one addition; blocks are read off it at the end.
///
/// Rays are OctoMap's `computeRayKeys` (Amanatides & Woo, 1987) in its own arithmetic. A ray to a
/// voxel's centre takes exactly |Δx|+|Δy|+|Δz| steps, so only a ray cut at the maximum range needs
/// OctoMap's stopping rule by length.
class FrameBits {
 public:
  explicit FrameBits(const VoxelGrid& grid) : grid_(grid) {}

  /// Touched blocks in ascending Morton order; valid until the next call. Cost: ray steps
  /// (≈ 1.6 ns each) plus one pass over the box; a box over 2³¹ bits is worked off in slabs.
  std::span<const TouchedBlock> trace(const VoxelScan& scan);

 private:
  struct Ray {
    Eigen::Vector3f end;
    VoxelKey end_key;
    bool cut;  // ends at the maximum range, not in a voxel's centre
  };
  struct Box {
    std::array<int, 3> min, max;  // keys, inclusive
  };

  void collect_rays(const VoxelScan& scan);
  void set_slab(int z_begin, int z_end);
  template <bool clipped>
  void walk(const Ray& ray, const Eigen::Vector3f& origin, VoxelKey origin_key);
  void mark_hits(const VoxelScan& scan);
  void read_blocks();

  VoxelGrid grid_;
  std::vector<Ray> rays_;
  Box box_{};
  std::array<int, 3> base_{};           // key of bit 0, multiples of 8
  std::array<std::int64_t, 3> size_{};  // voxels; x a multiple of 64, y and z of 8
  std::vector<std::uint64_t> miss_bits_, hit_bits_;
  std::vector<TouchedBlock> blocks_;
};

}  // namespace octosurf
