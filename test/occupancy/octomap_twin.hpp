#pragma once

#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"

#include <octomap/octomap.h>

#include <octosurf/scan.hpp>

namespace octosurf::test {

inline octomap::Pointcloud cloud_in_map(const Scan& scan) {
  octomap::Pointcloud cloud;
  for (const auto& p : scan.points) {
    if (!p.allFinite()) continue;
    const Eigen::Vector3f m =
        (scan.T_map_sensor.linear() * p.cast<double>() + scan.T_map_sensor.translation()).cast<float>();
    cloud.push_back(m.x(), m.y(), m.z());
  }
  return cloud;
}

/// Inserts the scan the slow way; `max_range` < 0: unlimited.
inline void insert_scan(octomap::OcTree& tree, const Scan& scan, double max_range) {
  const Eigen::Vector3f o = scan.T_map_sensor.translation().cast<float>();
  tree.insertPointCloud(cloud_in_map(scan), octomap::point3d(o.x(), o.y(), o.z()), max_range, false, true);
}

inline void update(octomap::OcTree& tree, const octomap::KeySet& free, const octomap::KeySet& occupied) {
  for (const octomap::OcTreeKey& key : free)
    if (occupied.find(key) == occupied.end()) tree.updateNode(key, false);
  for (const octomap::OcTreeKey& key : occupied) tree.updateNode(key, true);
}

/// A scan whose rays start in several places the slow way: each end voxel's ray from where that of its first
/// reading does, or from the first start in that place's voxel; what any ray hits is hit, what else any
/// passes is missed.
inline void insert_moving_scan(octomap::OcTree& tree, const Scan& scan, double max_range) {
  const auto in_map = [&](const Eigen::Vector3f& p) {
    const Eigen::Vector3f m = (scan.T_map_sensor * p.cast<double>()).cast<float>();
    return octomap::point3d(m.x(), m.y(), m.z());
  };
  using Key = std::array<std::uint16_t, 3>;
  const auto key_of = [&](const octomap::point3d& p) {
    const octomap::OcTreeKey k = tree.coordToKey(p);
    return Key{k[0], k[1], k[2]};
  };
  std::map<Key, std::pair<octomap::point3d, octomap::Pointcloud>> groups;  // by the starts' voxels
  std::set<Key> ends;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const octomap::point3d end = in_map(scan.points[i]), start = in_map(scan.origins[i]);
    if (!ends.insert(key_of(end)).second) continue;
    groups.try_emplace(key_of(start), start, octomap::Pointcloud()).first->second.second.push_back(end);
  }
  octomap::KeySet free, occupied;
  for (const auto& [key, group] : groups) {
    octomap::KeySet passed, hit;
    tree.computeDiscreteUpdate(group.second, group.first, passed, hit, max_range);
    free.insert(passed.begin(), passed.end());
    occupied.insert(hit.begin(), hit.end());
  }
  update(tree, free, occupied);
}

/// A scan with free rays the slow way: one to each of their voxels without a reading, up to it.
inline void insert_with_free_rays(octomap::OcTree& tree, const Scan& scan, double max_range) {
  const Eigen::Vector3f o = scan.T_map_sensor.translation().cast<float>();
  const octomap::point3d start(o.x(), o.y(), o.z());
  octomap::KeySet free, occupied, ends;
  const octomap::Pointcloud cloud = cloud_in_map(scan);
  tree.computeDiscreteUpdate(cloud, start, free, occupied, max_range);
  for (const octomap::point3d& reading : cloud) ends.insert(tree.coordToKey(reading));
  Scan rays = scan;
  rays.points = scan.free_rays;
  for (const octomap::point3d& ray : cloud_in_map(rays)) {
    octomap::point3d end = tree.keyToCoord(tree.coordToKey(ray));
    if (!ends.insert(tree.coordToKey(ray)).second) continue;
    if ((end - start).norm() > max_range)
      end = start + (end - start).normalized() * static_cast<float>(max_range);
    octomap::KeyRay passed;
    tree.computeRayKeys(start, end, passed);
    free.insert(passed.begin(), passed.end());
  }
  update(tree, free, occupied);
}

/// Every voxel of the lowest level below a leaf, as keys.
template <class Leaf, class Visit>
void for_each_voxel(const Leaf& leaf, const Visit& visit) {
  for_each_voxel_of(leaf.getIndexKey(), 16 - static_cast<int>(leaf.getDepth()), visit);
}

/// Number of voxels of the lowest level that a tree knows.
inline std::size_t known_voxels(const octomap::OcTree& tree) {
  std::size_t n = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    n += std::size_t{1} << (3 * (16 - leaf.getDepth()));
  return n;
}

/// The map as OctoMap reads its .bt, which keeps every known voxel.
inline octomap::OcTree through_bt(const occupancy::OccupancyMap& map) {
  std::istringstream bt(bt_of(map));
  octomap::OcTree tree(0.1);
  EXPECT_TRUE(tree.readBinary(bt));
  return tree;
}

/// Packed keys of the occupied voxels, found without our own traversal.
inline std::set<std::uint64_t> occupied_voxels(const occupancy::OccupancyMap& map) {
  std::set<std::uint64_t> keys;
  const octomap::OcTree tree = through_bt(map);
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    if (tree.isNodeOccupied(*leaf))
      for_each_voxel(leaf, [&](geometry::VoxelKey k) { keys.insert(k.packed()); });
  return keys;
}

/// Every voxel that either tree knows has the same value in the other.
inline void expect_equal(const occupancy::OccupancyMap& ours, const octomap::OcTree& theirs) {
  std::size_t compared = 0, different = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
    const int edge = 1 << (16 - leaf.getDepth());
    const octomap::OcTreeKey first = leaf.getIndexKey();
    // The corners of an undivided leaf stand for it; the number of known voxels catches the rest.
    for (int c = 0; c < (edge == 1 ? 1 : 8); ++c) {
      const auto at = [&](int axis) {
        return static_cast<std::uint16_t>(first[static_cast<unsigned>(axis)] +
                                          ((c >> axis & 1) ? edge - 1 : 0));
      };
      const auto lookup = ours.at(geometry::VoxelKey{at(0), at(1), at(2)});
      ++compared;
      if (lookup.state == occupancy::OccupancyMap::State::unknown || lookup.log_odds != leaf->getLogOdds())
        ++different;
    }
  }
  EXPECT_EQ(different, 0U) << "of " << compared;
  EXPECT_GT(compared, 100U);
  EXPECT_EQ(known_voxels(through_bt(ours)), known_voxels(theirs));
}

}  // namespace octosurf::test
