#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include <octosurf/occupancy.hpp>

namespace octosurf::planning {

/// Calls `visit` with the centre of each unknown voxel in `box` in which something could hide: it lies in a
/// cube of 3³ unknown ones. None of an empty octree. Narrower unknown space lies between a lidar's rays, or
/// beside end voxels over known ground. O(voxels of the box), some ns each 64.
void for_each_unknown(const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                      const std::function<void(const Eigen::Vector3d&)>& visit);

class UnknownRows;
/// The same for many boxes of one octree, with a cache of blocks.
class UnknownVoxels {
 public:
  explicit UnknownVoxels(OccupancyView octree) : octree_(std::move(octree)) {}
  void for_each(const Eigen::AlignedBox3d& box, const std::function<void(const Eigen::Vector3d&)>& visit);
  double resolution() const { return octree_.resolution(); }

 private:
  OccupancyView octree_;
  std::map<std::array<int, 3>, std::shared_ptr<const UnknownRows>> blocks_;
};

}  // namespace octosurf::planning
