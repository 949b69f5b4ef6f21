#include <octomap/OcTree.h>

#include <octosurf/adapters/octomap.hpp>

void insert(octomap::OcTree& tree, const octomap::Pointcloud& cloud, const octomap::point3d& sensor) {
  const double max_range = 4;    // m; -1: none
  const bool lazy = false;       // true: call updateInnerOccupancy() yourself
  const bool discretize = true;  // one ray per voxel, not per point
  octosurf::insert_point_cloud(tree, cloud, sensor, max_range, lazy, discretize);
}
