#pragma once

#include <cmath>
#include <octomap/OccupancyOcTreeBase.h>

#include <octosurf/adapters/detail/tree_writer.hpp>

// insert_point_cloud() for any OctoMap octree. To convert between a map and an octomap::OcTree use
// adapters/octree.hpp, which also needs the library.

namespace octosurf {
namespace detail {

inline std::array<std::uint16_t, 3> array_of(const octomap::OcTreeKey& key) {
  return {key[0], key[1], key[2]};
}

/// OctoMap's rule: beyond the range a ray ends at it and hits nothing.
template <class Tree>
void add_ray(const Tree& tree, const octomap::point3d& origin, const octomap::point3d& end,
             const octomap::OcTreeKey& key, double max_range, bool to_centre, ScanRays& rays) {
  if (max_range < 0 || (end - origin).norm() <= max_range) {
    rays.add({end.x(), end.y(), end.z()}, array_of(key), true, to_centre);
    return;
  }
  const octomap::point3d cut = origin + (end - origin).normalized() * static_cast<float>(max_range);
  if (octomap::OcTreeKey at; tree.coordToKeyChecked(cut, at))
    rays.add({cut.x(), cut.y(), cut.z()}, array_of(at), false, false);
}

template <class Tree>
void collect_rays(const Tree& tree, const octomap::Pointcloud& scan, const octomap::point3d& origin,
                  double max_range, bool discretize, ScanRays& scratch) {
  scratch.clear();
  octomap::OcTreeKey last;
  bool any = false;
  for (const octomap::point3d& point : scan) {
    octomap::OcTreeKey key;
    if (!std::isfinite(point.x() + point.y() + point.z()) || !tree.coordToKeyChecked(point, key)) continue;
    if (!discretize) {
      add_ray(tree, origin, point, key, max_range, false, scratch);
      continue;
    }
    if (any && key == last) continue;
    any = true;
    last = key;
    if (scratch.is_new_end(array_of(key)))
      add_ray(tree, origin, tree.keyToCoord(key), key, max_range, true, scratch);
  }
}

}  // namespace detail

/// `tree.insertPointCloud(scan, sensor_origin, max_range, lazy_eval, discretize)`, several times faster, for
/// `octomap::OcTree` and any octree derived from OctoMap's occupancy base.
///
/// 1. The resulting tree is the same: same nodes, same values, same pruning.
/// 2. `threads` change the time, never the result.
/// 3. Points that are not finite or outside the octree are skipped; OctoMap lets them wrap around.
///
/// `discretize` is true by default: one ray per distinct end voxel is what makes a depth
/// image affordable (OctoMap's own default is false). With a bounding-box limit, change detection or
/// a sensor outside the octree it calls OctoMap's own, because their state is not within reach.
///
/// The rays are walked by octosurf::core. Scratch memory stays with the calling thread: some megabytes for a
/// depth camera, 256 MB a thread at most. Cost: about 5 ns a
/// point, 1 ns a ray step, and the nodes that change.
template <class Tree>
void insert_point_cloud(Tree& tree, const octomap::Pointcloud& scan, const octomap::point3d& sensor_origin,
                        double max_range = -1, bool lazy_eval = false, bool discretize = true,
                        int threads = 1) {
  octomap::OcTreeKey origin_key;
  if (tree.bbxSet() || tree.isChangeDetectionEnabled() ||
      !tree.coordToKeyChecked(sensor_origin, origin_key)) {
    tree.insertPointCloud(scan, sensor_origin, max_range, lazy_eval, discretize);
    return;
  }
  thread_local detail::ScanRays scratch;
  detail::collect_rays(tree, scan, sensor_origin, max_range, discretize, scratch);
  const auto touched = scratch.trace({sensor_origin.x(), sensor_origin.y(), sensor_origin.z()},
                                     detail::array_of(origin_key), tree.getResolution(), threads);
  detail::BatchInsert<Tree>(tree, lazy_eval)(touched);
}

}  // namespace octosurf
