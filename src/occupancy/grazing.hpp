#pragma once

#include "sensing/downsample.hpp"

#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::occupancy {

/// Answers "does a ray of this scan pass through this voxel and cross that plane beyond s?", so that
/// grazing rays along a floor never eat the floor (octomap#180). Rays are binned by direction on
/// the first question; a question looks at the rays within the voxel's angular size.
class GrazingTest {
 public:
  GrazingTest(const sensing::VoxelScan& scan, const geometry::VoxelGrid& grid) : scan_(scan), grid_(grid) {}

  bool crosses(geometry::VoxelKey voxel, const Plane& plane, double tolerance);

 private:
  static constexpr int cells = 128;  // an edge of a cube face, 0.6° to 0.9° a cell

  void index();
  Eigen::Vector3f end_of(const sensing::EndVoxel& end) const;
  static int bin_of(const Eigen::Vector3f& direction);

  const sensing::VoxelScan& scan_;
  const geometry::VoxelGrid& grid_;
  std::vector<std::uint32_t> first_;  // per bin, into ends_
  std::vector<Eigen::Vector3f> ends_;
};

}  // namespace octosurf::occupancy
