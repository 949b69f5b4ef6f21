#pragma once

#include "planning/voxel_matter.hpp"

#include <Eigen/Core>
#include <span>
#include <vector>

#include <octosurf/contact.hpp>

namespace octosurf::planning {

/// The areas of the plane covered by obstacles over the box `low` … `high` of the surface's frame: convex
/// polygons (counter-clockwise, the surface's frame) that may overlap. Obstacles are the contents of occupied
/// voxels of other surfaces or none (voxel_matter.hpp; `others` as MatterOfVoxels') that are partly between
/// `obstacle_from_m` and `clearance_m` over the plane.
///
/// Areas of flat voxels are rounded outward by up to ReadingModel::pose_sigma, their uncertainty; each is
/// independent of the others.
std::vector<Ring2> obstacles_over(const Surface& surface, const Eigen::Vector2d& low,
                                  const Eigen::Vector2d& high, const ContactLimits& limits,
                                  const OccupancyView& octree, const Snapshot* others);

/// Likewise areas covered by unknown voxels between `obstacle_from_m` and `unknown_to_m` (unknown_space.hpp).
std::vector<Ring2> unknown_over(const Surface& surface, const Eigen::Vector2d& low,
                                const Eigen::Vector2d& high, const ContactLimits& limits,
                                const OccupancyView& octree);

/// Projections of voxels of edge d onto the plane, as convex polygons (counter-clockwise, the surface's
/// frame) that may overlap. Voxels that fill a box are projected together.
std::vector<Ring2> projected(const Surface& surface, std::span<const Eigen::Vector3d> centres, double d);

/// The same for flat voxels: those of one surface in one row together.
std::vector<Ring2> projected(const Surface& surface, std::span<const VoxelMatter> flat);

}  // namespace octosurf::planning
