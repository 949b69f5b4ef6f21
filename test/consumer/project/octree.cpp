// A board, as OctoMap's octree has it.
#include <cstdio>

#include <octosurf/adapters/octomap_follower.hpp>
#include <octosurf/mapper.hpp>

int main() {
  octosurf::Scan scan;
  for (float x = -1; x < 1; x += 0.01f)
    for (float y = -1; y < 1; y += 0.01f) scan.points.emplace_back(x, y, -1.51f);
  scan.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 1.5);

  octosurf::Mapper mapper;
  octosurf::OctomapFollower follower;
  mapper.insert(scan);
  const auto tree = follower.follow(mapper.map().octree());
  const octomap::OcTreeNode* node = tree->search(0.5, 0.5, -0.01);
  std::printf("%s\n", node != nullptr && tree->isNodeOccupied(node) ? "occupied" : "free");
}
