// The batched insertion against OctoMap's own, its slow and obvious twin.
#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include <sstream>

#include <octosurf/error.hpp>

#include "occupancy/occupancy_map.hpp"
#include "support/random_scans.hpp"

namespace octosurf {
namespace {

octomap::Pointcloud cloud_in_map(const Scan& scan) {
  octomap::Pointcloud cloud;
  for (const auto& p : scan.points) {
    const Eigen::Vector3f m =
        (scan.T_map_sensor.linear() * p.cast<double>() + scan.T_map_sensor.translation()).cast<float>();
    cloud.push_back(m.x(), m.y(), m.z());
  }
  return cloud;
}

/// Every voxel that either tree knows has the same value in the other.
void expect_equal(const OccupancyMap& ours, const octomap::OcTree& theirs) {
  std::size_t compared = 0, different = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
    const int edge = 1 << (16 - leaf.getDepth());
    const octomap::OcTreeKey first = leaf.getIndexKey();
    // The corners of an undivided leaf stand for it; size() below catches the rest.
    for (int c = 0; c < (edge == 1 ? 1 : 8); ++c) {
      const auto at = [&](int axis, int bit) {
        return static_cast<std::uint16_t>(first[static_cast<unsigned>(axis)] + ((c >> bit & 1) ? edge - 1 : 0));
      };
      const auto lookup = ours.at({at(0, 0), at(1, 1), at(2, 2)});
      ++compared;
      if (lookup.state == OccupancyMap::State::unknown || lookup.log_odds != leaf->getLogOdds()) ++different;
    }
  }
  EXPECT_EQ(different, 0U) << "of " << compared;
  EXPECT_GT(compared, 100U);
}

/// Number of voxels of the lowest level that a tree knows.
std::size_t known_voxels(const octomap::OcTree& tree) {
  std::size_t n = 0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf)
    n += std::size_t{1} << (3 * (16 - leaf.getDepth()));
  return n;
}

std::size_t known_voxels(const OccupancyMap& map) {
  std::stringstream bt;  // .bt keeps every known voxel
  map.write_bt(bt);
  octomap::OcTree tree(0.1);
  tree.readBinary(bt);
  return known_voxels(tree);
}

void compare(double resolution, double max_range, std::uint64_t seed, std::size_t rays, double shift) {
  SCOPED_TRACE("seed " + std::to_string(seed) + " resolution " + std::to_string(resolution) + " max_range " +
               std::to_string(max_range) + " shift " + std::to_string(shift));
  std::mt19937_64 rng(seed);
  OccupancyParameters parameters;
  parameters.resolution = resolution;
  OccupancyMap ours(parameters);
  octomap::OcTree theirs(resolution);
  Downsampler downsample(ours.grid());
  for (int i = 0; i < 6; ++i) {
    const Scan scan = test::room_scan(rng, rays, {2.1, 1.7, 1.3}, Eigen::Vector3d(shift, -shift, shift));
    const Eigen::Vector3f o = scan.T_map_sensor.translation().cast<float>();
    theirs.insertPointCloud(cloud_in_map(scan), octomap::point3d(o.x(), o.y(), o.z()), max_range, false, true);
    const VoxelScan voxels = downsample(scan, 0, max_range < 0 ? INFINITY : max_range);
    ours.insert(voxels, downsample, nullptr);
  }
  expect_equal(ours, theirs);
  EXPECT_EQ(known_voxels(ours), known_voxels(theirs));
}

TEST(OccupancyInsert, EqualsOctomapOnSimulatedScans) {
  for (const double resolution : {0.01, 0.02, 0.05, 0.11})
    for (const double max_range : {-1.0, 1.0, 2.0})
      compare(resolution, max_range, 17, resolution < 0.02 ? 1500 : 4000, 0);
}

TEST(OccupancyInsert, EqualsOctomapFarFromTheOrigin) {
  compare(0.02, -1, 3, 3000, 97.31);
  compare(0.05, 1.5, 4, 3000, -611.7);
}

}  // namespace
}  // namespace octosurf
