#pragma once

#include "geometry/voxel_grid.hpp"
#include "sensing/voxel_table.hpp"

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::sensing {

/// OctoMap's length of a vector: summed in float, its root taken in double.
inline double norm_of(float x, float y, float z) {
  return std::sqrt(static_cast<double>(x * x + y * y + z * z));
}

/// One distinct voxel that scan points ended in (paper III-A1).
struct EndVoxel {
  geometry::VoxelKey key;
  std::uint16_t start = 0;                             ///< of its ray, index into VoxelScan::starts
  std::uint32_t count = 0;                             ///< readings in it; 0: a ray that met nothing
  Eigen::Vector3f centroid = Eigen::Vector3f::Zero();  ///< mean of its readings, map frame
};

/// A scan grouped by voxel, in the map frame.
struct VoxelScan {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  double max_range = std::numeric_limits<double>::infinity();
  std::vector<EndVoxel> ends;  ///< in the order of the scan's first point in each, free rays last
  /// Where rays start, one place in each voxel where some do; empty: all at `origin`. An end voxel's ray is
  /// that of its first reading.
  std::vector<Eigen::Vector3f> starts;
  std::size_t not_finite = 0, too_near = 0, out_of_map = 0, beyond_range = 0;

  const Eigen::Vector3f& start_of(const EndVoxel& end) const {
    return starts.empty() ? origin : starts[end.start];
  }
  /// OctoMap's rule: a ray ends at its voxel's centre, or at max_range from its start where that is nearer.
  bool within_range(const EndVoxel& end, const Eigen::Vector3f& centre) const {
    const Eigen::Vector3f v = centre - start_of(end);
    return norm_of(v.x(), v.y(), v.z()) <= max_range;
  }
};

/// m: mapping range of readings if `max_range` is not given; points beyond it only free space.
inline constexpr double depth_camera_max_range = 4.0;
inline double default_max_range(SensorKind sensor) {
  return sensor == SensorKind::depth_camera ? depth_camera_max_range
                                            : std::numeric_limits<double>::infinity();
}

/// Groups points by voxel, runs of neighbours at a time. O(points); about 15 ns a point.
class Downsampler {
 public:
  explicit Downsampler(const geometry::VoxelGrid& grid) : grid_(grid) {}

  /// `scan` as seen from `T_map_sensor`, which must be rigid. Throws Error(data) if the sensor itself is
  /// outside the octree, or its rays start there, in over 65536 voxels, or not one for each reading. The
  /// result does not depend on `threads`.
  VoxelScan operator()(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, double min_range,
                       double max_range, int threads = 1);
  /// At the scan's own pose.
  VoxelScan operator()(const Scan& scan, double min_range, double max_range, int threads = 1) {
    return (*this)(scan, scan.T_map_sensor, min_range, max_range, threads);
  }

  /// Index into the last result's `ends`, or −1.
  std::int64_t find(geometry::VoxelKey key) const;
  /// The same plus one for the cube of 4³ voxels that holds `key`, by Morton index.
  const VoxelTable::Cube& places_near(geometry::VoxelKey key) const {
    return table_.numbers_near({key.x, key.y, key.z});
  }

 private:
  /// Consecutive points in one voxel.
  struct Run {
    geometry::VoxelKey key;
    std::uint32_t count = 0;                        // of readings
    std::uint32_t first = 0;                        // of the scan's points
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();  // relative to the voxel's centre, for float precision
  };
  /// One thread's part of a scan.
  struct ThreadPart {
    std::vector<Run> runs;
    std::size_t not_finite = 0, too_near = 0, out_of_map = 0;
  };
  void collect_runs(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, double min_range,
                    std::size_t begin, std::size_t end, ThreadPart& part) const;
  void add(const Run& run, VoxelScan& out);
  void add_free_rays(const Scan& scan, const Eigen::Isometry3d& T_map_sensor, VoxelScan& out);
  std::uint16_t start_of(const Eigen::Vector3f& origin, const Scan& scan,
                         const Eigen::Isometry3d& T_map_sensor, VoxelScan& out);

  geometry::VoxelGrid grid_;
  VoxelTable table_;  // place in `ends` plus one
  std::vector<ThreadPart> parts_;
  std::vector<geometry::VoxelKey> start_keys_;  // of the result's starts
};

}  // namespace octosurf::sensing
