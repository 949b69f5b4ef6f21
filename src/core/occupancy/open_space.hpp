#pragma once
// Free space that a sensor can have been in, without pockets behind surfaces.
#include "geometry/voxel_key.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/voxel_tree.hpp"

#include <cstdint>
#include <tsl/robin_map.h>

namespace octosurf::occupancy {

/// Determines from which side occupied voxels were seen. The ray of a reading that ends behind a surface
/// frees voxels there: pockets of free space from which nothing was seen. Around a sensor everything is free,
/// and its rays connect that space with what it saw. Open is free space that is face-connected with an
/// aligned cube of 4³ free voxels; rays of outliers, few and a voxel wide, do not fill such a cube. In a map
/// without one all free space is open, and in a map without free space unknown space is. Results are cached:
/// free space must not change meanwhile.
class OpenSpace {
 public:
  OpenSpace(const OccupancyMap& map, const VoxelTree& tree);
  /// O(1) amortised: visits only as much of a component as is needed to decide.
  bool contains(geometry::VoxelKey key);

 private:
  bool in_free_cube(geometry::VoxelKey key);
  bool is_connected(geometry::VoxelKey key);

  const OccupancyMap& map_;
  enum class Rule { connected, free, unknown } rule_;
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash> cubes_;  ///< whether all free
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash> open_;   ///< free voxels outside such cubes
};

}  // namespace octosurf::occupancy
