#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>

#include <octosurf/occupancy.hpp>

namespace octosurf::planning {

/// Calls `visit` with the centre of each unknown voxel in `box` in which something could hide: it lies in a
/// cube of 3³ unknown ones. None of an empty octree. Narrower unknown space is what lies between a lidar's
/// rays, or beside voxels in which readings ended, over ground that is well known. O(voxels of the box), some
/// ns each 64.
void for_each_unknown(const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                      const std::function<void(const Eigen::Vector3d&)>& visit);

}  // namespace octosurf::planning
