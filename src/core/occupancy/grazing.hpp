#pragma once

#include "sensing/downsample.hpp"

#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::occupancy {

/// Tests whether a ray of this scan passes through a voxel and crosses a plane beyond s, so that grazing rays
/// along a floor do not erase it (octomap#180). Rays are binned by direction on first use; a test examines
/// the rays within the voxel's angular size. All rays are assumed to start at the scan's origin: if the
/// sensor moved within a scan, their ends are right, and so are the sides of the plane on which they end; the
/// voxels that they pass are approximate.
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
