#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include <octosurf/contact.hpp>

namespace octosurf {

/// Centres of the occupied voxels that are not this surface's and of which a part lies between
/// `obstacle_from_m` and `clearance_m` over its plane, above the box `low` … `high` of its frame.
std::vector<Eigen::Vector3d> voxels_over(const Surface& surface, const Eigen::Vector2d& low,
                                         const Eigen::Vector2d& high, const ContactLimits& limits,
                                         const OccupancyView& octree);

/// What voxels of edge d cover of the plane, as convex polygons (counter-clockwise, the surface's frame) that
/// may overlap. Voxels that fill a box together are projected together.
std::vector<Ring2> projected(const Surface& surface, std::span<const Eigen::Vector3d> centres, double d);

/// Where `octree` knows free space `gap_depth_m` behind the plane, in the box of the surface's frame and on
/// its polygons: rectangles (counter-clockwise) of cells of d/2 about the places that were asked.
std::vector<Ring2> gaps_in(const Surface& surface, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const ContactLimits& limits, const OccupancyView& octree);

}  // namespace octosurf
