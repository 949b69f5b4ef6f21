#pragma once

#include "occupancy/surface_numbers.hpp"
#include "occupancy/voxel_payload.hpp"

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include <octosurf/occupancy.hpp>

namespace octosurf::occupancy {

/// A cube of 4³ voxels, or a larger one whose voxels are all alike.
struct Cube {
  std::array<std::uint16_t, 3> corner{};  ///< as a Leaf's
  std::uint8_t level = 2;                 ///< as a Leaf's; 2 or more
  std::uint64_t known = 0;     ///< a bit for each voxel, in Morton order; of a larger cube all or none
  std::uint64_t occupied = 0;  ///< likewise
  std::uint64_t points = 0;    ///< voxels whose point is stored, among the occupied ones
  const VoxelPayload* payloads = nullptr;   ///< of these, in their order: payload.hpp decodes them
  const SurfaceNumbers* numbers = nullptr;  ///< of their surfaces
  SurfaceId surface(unsigned voxel) const;  ///< of an occupied voxel, by Morton index; 0: pending
};

/// Calls `visit` for the cubes with known voxels (or only those with occupied ones) that meet `box`, in
/// Morton order, until it returns false. The fastest way to read all of a region: some 50 ns for 4³ voxels.
void for_each_cube(const OccupancyView& view, const Eigen::AlignedBox3d& box,
                   const std::function<bool(const Cube&)>& visit, bool occupied_only = false);

/// Of OccupancyView::for_each_changed_cube().
std::vector<Eigen::AlignedBox3d> changed_cubes(const OccupancyView& before, const OccupancyView& now);

}  // namespace octosurf::occupancy
