#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include <octosurf/occupancy.hpp>

namespace octosurf::occupancy {

/// Where a reading was taken, m, map frame, and how far from it matter may be the same.
struct ReadingEnd {
  Eigen::Vector3d end;
  double reach;
};

/// How readings that are not inserted agree with the octree.
struct Agreement {
  std::size_t agrees = 0;         ///< an occupied voxel is within reach
  std::size_t in_free_space = 0;  ///< none is, and at least three rays went through there
};

/// Some 0.5 µs a reading.
Agreement agreement_of(std::span<const ReadingEnd> readings, const OccupancyView& octree);

}  // namespace octosurf::occupancy
