#pragma once

#include "surfaces/map_view.hpp"

#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::cylinders {

/// Finds points that are seen through a surface. Results are cached, so surfaces must not change meanwhile.
class SeenThrough {
 public:
  explicit SeenThrough(const surfaces::MapView& map) : map_(map) {}

  /// The surface just in front of the point that its line of sight crosses; 0: none.
  SurfaceId operator()(PointId i);

 private:
  using Surfaces = std::vector<const surfaces::SurfaceModel*>;
  static constexpr SurfaceId unknown = ~SurfaceId{0};
  static constexpr std::uint64_t blocks = 0xfff8fff8fff8ULL;  // of eight voxels along each axis

  const Surfaces& near(geometry::VoxelKey key);
  SurfaceId in_front_of(const occupancy::VoxelPoint& p);

  const surfaces::MapView& map_;
  std::vector<SurfaceId> answers_;
  tsl::robin_map<std::uint64_t, Surfaces, geometry::PackedKeyHash> near_;
};

}  // namespace octosurf::cylinders
