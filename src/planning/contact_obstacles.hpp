#pragma once

#include "planning/voxel_matter.hpp"

#include <Eigen/Core>
#include <span>
#include <vector>

#include <octosurf/contact.hpp>

namespace octosurf::planning {

/// What stands over the box `low` … `high` of the surface's frame covers of its plane: convex polygons
/// (counter-clockwise, the surface's frame) that may overlap. Taken is what occupied voxels that are not this
/// surface's hold (voxel_matter.hpp; `others` as MatterOfVoxels') where a part of it lies between
/// `obstacle_from_m` and `clearance_m` over the plane.
///
/// What flat voxels cover is rounded outward by up to ReadingModel::pose_sigma, below which nobody knows
/// where they are; what one covers never depends on the others.
std::vector<Ring2> obstacles_over(const Surface& surface, const Eigen::Vector2d& low,
                                  const Eigen::Vector2d& high, const ContactLimits& limits,
                                  const OccupancyView& octree, const Snapshot* others);

/// What voxels of edge d cover of the plane, as convex polygons (counter-clockwise, the surface's frame) that
/// may overlap. Voxels that fill a box together are projected together.
std::vector<Ring2> projected(const Surface& surface, std::span<const Eigen::Vector3d> centres, double d);

/// The same of voxels that are flat: those of one surface in one row together.
std::vector<Ring2> projected(const Surface& surface, std::span<const VoxelMatter> flat);

/// Where `octree` knows free space `gap_depth_m` behind the plane, in the box of the surface's frame and on
/// its polygons: rectangles (counter-clockwise) of cells of d/2 about the places that were asked.
std::vector<Ring2> gaps_in(const Surface& surface, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const ContactLimits& limits, const OccupancyView& octree);

}  // namespace octosurf::planning
