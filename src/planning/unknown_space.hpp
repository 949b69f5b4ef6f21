#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include <octosurf/occupancy.hpp>

namespace octosurf::planning {

/// Calls `visit` with the centre of each unknown voxel in `box` in which something could hide: it lies in a
/// cube of 3³ unknown ones. None of an empty octree. Narrower unknown space lies between a lidar's rays, or
/// beside end voxels over known ground. O(voxels of the box), some ns each 64.
void for_each_unknown(const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                      const std::function<void(const Eigen::Vector3d&)>& visit);

/// The same for many boxes of one octree, with a cache of blocks.
class UnknownVoxels {
 public:
  explicit UnknownVoxels(OccupancyView octree) : octree_(std::move(octree)) {}
  void for_each(const Eigen::AlignedBox3d& box, const std::function<void(const Eigen::Vector3d&)>& visit);
  double resolution() const { return octree_.resolution(); }

 private:
  static constexpr int edge = 32;                        // voxels
  using Block = std::array<std::uint32_t, edge * edge>;  // rows along x, by z and y
  const Block& block(const std::array<int, 3>& place);

  OccupancyView octree_;
  std::map<std::array<int, 3>, Block> blocks_;
};

}  // namespace octosurf::planning
