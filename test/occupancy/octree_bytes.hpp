#pragma once

#include "geometry/morton.hpp"
#include "occupancy/occupancy_map.hpp"
#include "support/testing.hpp"

#include <unistd.h>

#include <octosurf/occupancy.hpp>

namespace octosurf::test {

inline OccupancyParameters with_resolution(double resolution, double occupied = 0.5) {
  OccupancyParameters parameters;
  parameters.resolution = resolution;
  parameters.occupied = occupied;
  return parameters;
}

/// By one thread, without surfaces.
inline void insert(occupancy::OccupancyMap& map, const Scan& scan, double max_range = 30) {
  sensing::Downsampler downsample(map.grid());
  map.insert(downsample(scan, 0, max_range), downsample, nullptr);
}

/// All nodes, as a map file has them, by path.
inline std::map<std::uint64_t, std::string> parts_of(const occupancy::OccupancyMap& map) {
  std::map<std::uint64_t, std::string> parts;
  occupancy::for_each_part(map.now(), {},
                           [&](std::uint64_t path, const std::string& nodes) { parts[path] = nodes; });
  return parts;
}
inline std::string bytes_of(const occupancy::OccupancyMap& map) {
  std::string bytes;
  for (const auto& [path, nodes] : parts_of(map)) bytes += std::to_string(path) + nodes;
  return bytes;
}

/// In Morton order.
inline std::vector<occupancy::VoxelPoint> points_of(const occupancy::OccupancyMap& map) {
  std::vector<occupancy::VoxelPoint> points;
  map.for_each_point([&](const occupancy::VoxelPoint& p) { points.push_back(p); });
  return points;
}

inline std::uint64_t morton(geometry::VoxelKey k) { return geometry::morton_of(k.x, k.y, k.z); }

/// Calls with the key of every voxel in a cube of 2^level of them to an edge.
template <class Corner, class Visit>
void for_each_voxel_of(const Corner& corner, int level, const Visit& visit) {
  const int edge = 1 << level;
  for (int i = 0; i < edge * edge * edge; ++i)
    visit(geometry::VoxelKey{static_cast<std::uint16_t>(corner[0] + i % edge),
                             static_cast<std::uint16_t>(corner[1] + i / edge % edge),
                             static_cast<std::uint16_t>(corner[2] + i / edge / edge)});
}

inline void expect_same_point(const occupancy::VoxelPoint& a, const occupancy::VoxelPoint& b,
                              SurfaceId surface) {
  EXPECT_EQ(a.key, b.key);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.view, b.view);
  EXPECT_EQ(a.range_class, b.range_class);
  EXPECT_EQ(a.surface, surface);
}

using Voxels = std::map<geometry::VoxelKey, float>;  ///< log-odds of all that are known

inline void add(const OccupancyView::Leaf& leaf, Voxels& voxels) {
  for_each_voxel_of(leaf.corner, leaf.level, [&](geometry::VoxelKey k) { voxels[k] = leaf.log_odds; });
}

inline Voxels voxels_of(const OccupancyView& view) {
  Voxels voxels;
  view.for_each_leaf([&](std::span<const OccupancyView::Leaf> leaves) {
    for (const OccupancyView::Leaf& leaf : leaves) add(leaf, voxels);
  });
  return voxels;
}

/// What of the way from `a` to `b` is in a cube, as parts of it; the first is larger where it misses the
/// cube.
inline std::pair<double, double> part_in_cube(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                              const Eigen::Vector3d& centre, double half_edge) {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = b[axis] - a[axis], low = centre[axis] - half_edge - a[axis],
                 high = low + 2 * half_edge;
    if (way == 0) {
      if (low > 0 || high < 0) return {1, 0};
      continue;
    }
    enter = std::max(enter, std::min(low / way, high / way));
    leave = std::min(leave, std::max(low / way, high / way));
  }
  return {enter, leave};
}

/// The octree in a file of these bytes.
inline occupancy::OccupancyMap octree_of_file(const std::string& bytes,
                                              const OccupancyParameters& parameters = {}) {
  std::string file = (std::filesystem::temp_directory_path() / "octosurf_octree_XXXXXX").string();
  const int opened = ::mkstemp(file.data());
  EXPECT_GE(opened, 0);
  ::close(opened);
  std::ofstream(file, std::ios::binary) << bytes;
  const std::shared_ptr<void> guard(nullptr, [&](void*) { std::filesystem::remove(file); });
  return occupancy::OccupancyMap::read_octomap(file, parameters);
}
inline std::string bt_of(const occupancy::OccupancyMap& map) {
  std::ostringstream bt;
  occupancy::write_bt(map.now(), bt);
  return std::move(bt).str();
}

}  // namespace octosurf::test
