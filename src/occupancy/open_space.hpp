#pragma once
// Free space that a sensor can have been in, apart from pockets behind surfaces.
#include "geometry/voxel_key.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/voxel_tree.hpp"

#include <cstdint>
#include <tsl/robin_map.h>

namespace octosurf::occupancy {

/// What occupied voxels are seen from. Readings scatter: the ray of one that ends behind a surface frees
/// voxels between the surface and its end, pockets that are free but that nothing was seen from. Where a
/// sensor was, all around it is free, and its rays connect what it saw with there. Open is what is free and
/// connected, by faces of voxels, with an aligned cube of 4³ voxels that is all free: rays of outlying
/// readings, a voxel wide and few, do not fill one. In a map without such a cube all that is free is open,
/// and in one that knows nothing free what is unknown. Answers are remembered: what is free must not change
/// meanwhile.
class OpenSpace {
 public:
  OpenSpace(const OccupancyMap& map, const VoxelTree& tree);
  /// O(1) amortised: of each component as much is visited as is needed to know.
  bool contains(geometry::VoxelKey key);

 private:
  bool in_free_cube(geometry::VoxelKey key);
  bool is_connected(geometry::VoxelKey key);

  const OccupancyMap& map_;
  enum class Rule { connected, free, unknown } rule_;
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash> cubes_;  ///< that are all free
  tsl::robin_map<std::uint64_t, bool, geometry::PackedKeyHash> open_;   ///< free voxels in no such cube
};

}  // namespace octosurf::occupancy
