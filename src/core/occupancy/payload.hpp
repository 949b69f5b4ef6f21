#pragma once

#include "occupancy/occupancy_map.hpp"
#include "occupancy/surface_numbers.hpp"
#include "occupancy/voxel_payload.hpp"
#include "sensing/reading_code.hpp"

#include <cstdint>

namespace octosurf::occupancy {

/// Stores a point inside voxel `key`, without its view. Rounds to 1/256 of the voxel's edge.
inline void store_place(VoxelPayload& payload, const geometry::VoxelGrid& grid, geometry::VoxelKey key,
                        const Eigen::Vector3f& point) {
  const sensing::PlaceInVoxel place = sensing::place_in_voxel(grid, key, point);
  payload.offset_x = place[0];
  payload.offset_y = place[1];
  payload.offset_z = place[2];
}
/// The same as it is seen from `origin`.
inline void store_point(VoxelPayload& payload, const geometry::VoxelGrid& grid, geometry::VoxelKey key,
                        const Eigen::Vector3f& point, const Eigen::Vector3f& origin) {
  store_place(payload, grid, key, point);
  const Eigen::Vector3f view = origin - point;
  payload.view = sensing::encode_view(view) & 0xfff;
  payload.range_class = sensing::range_class_of(view.norm()) & 0xf;
}
inline Eigen::Vector3d load_point(const VoxelPayload& payload, const geometry::VoxelGrid& grid,
                                  geometry::VoxelKey key) {
  const auto place = [](unsigned offset) { return static_cast<std::uint8_t>(offset); };
  return sensing::point_at(grid, key,
                           {place(payload.offset_x), place(payload.offset_y), place(payload.offset_z)});
}
inline VoxelPoint point_of(const VoxelPayload& payload, const SurfaceNumbers& numbers,
                           const geometry::VoxelGrid& grid, geometry::VoxelKey key, PayloadPlace place = {},
                           float log_odds = 0) {
  return {key,
          load_point(payload, grid, key).cast<float>(),
          sensing::views[payload.view],
          static_cast<std::uint8_t>(payload.range_class),
          numbers.id(payload.surface),
          log_odds,
          place};
}

}  // namespace octosurf::occupancy
