#pragma once

#include <cstdint>

namespace octosurf::occupancy {

/// Data of a voxel with a point besides its log-odds, in 8 bytes: number of its surface, its representative
/// point inside the voxel, and the direction and distance from which the point was seen.
struct VoxelPayload {
  std::uint32_t surface : 24 = 0;  ///< SurfaceNumbers; 0: pending
  std::uint32_t offset_x : 8 = 0;  ///< 1/256 of the voxel's edge
  std::uint32_t offset_y : 8 = 0;
  std::uint32_t offset_z : 8 = 0;
  std::uint32_t view : 12 = 0;        ///< octahedral, toward the sensor, 6 bits a coordinate
  std::uint32_t range_class : 4 = 0;  ///< distance to the sensor, steps of √2; 0: no point

  bool has_point() const { return range_class != 0; }
  friend bool operator==(const VoxelPayload&, const VoxelPayload&) = default;
};
static_assert(sizeof(VoxelPayload) == 8);

/// Location of a brick's payloads, in the order of the voxels that own them.
struct PayloadRun {
  std::uint32_t index = 0;
  std::uint8_t size_class = 0;  ///< 0: none; c: room for 2^(c+1)
  friend bool operator==(const PayloadRun&, const PayloadRun&) = default;
};

/// Location of one payload, until the octree's next insert.
struct PayloadPlace {
  PayloadRun run;  ///< empty: unknown
  std::uint8_t rank = 0;
  friend bool operator==(const PayloadPlace&, const PayloadPlace&) = default;
};

}  // namespace octosurf::occupancy
