#pragma once

#include "geometry/voxel_grid.hpp"
#include "occupancy/ray_bits.hpp"
#include "sensing/downsample.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace octosurf::occupancy {

/// The voxels that one scan's rays hit and miss, whatever octree they are applied to.
struct TouchedVoxels {
  std::vector<TouchedBlock> blocks;  ///< ascending Morton order, with their masks in `masks`
  std::unique_ptr<std::uint64_t[]> masks;
  std::vector<std::uint32_t> ends;  ///< index into the scan's ends of each hit, in Morton order
};

/// Traces scans on a grid, from one place after the other where a sensor moved within a scan. Memory is kept
/// from scan to scan (RayBits).
class RayTracer {
 public:
  explicit RayTracer(const geometry::VoxelGrid& grid) : grid_(grid) {}

  /// `index` finds the end voxels of `scan` by key. `threads` share the rays; the result does not depend on
  /// them. Cost: about 1 ns a ray step.
  TouchedVoxels operator()(const sensing::VoxelScan& scan, const sensing::Downsampler& index, int threads);

 private:
  TouchedVoxels trace(const sensing::VoxelScan& scan, std::size_t start, int threads);

  geometry::VoxelGrid grid_;
  RayBits bits_;
};

}  // namespace octosurf::occupancy
