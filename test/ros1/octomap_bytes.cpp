// What octomap_msgs::binaryMapToMsg() sends of the octree in an .ot: liboctomap's own reader and writer.
#include <iostream>
#include <memory>
#include <octomap/OcTree.h>

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(argv[1]));
  const auto* octree = dynamic_cast<const octomap::OcTree*>(tree.get());
  return octree != nullptr && octree->writeBinaryData(std::cout) ? 0 : 1;
}
