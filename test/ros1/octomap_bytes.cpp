// What octomap_msgs::binaryMapToMsg() sends of the octree in a .bt: liboctomap's own reader and writer.
#include <iostream>
#include <octomap/OcTree.h>

int main(int argc, char** argv) {
  octomap::OcTree tree(1);
  if (argc != 2 || !tree.readBinary(argv[1])) return 1;
  return tree.writeBinaryData(std::cout) ? 0 : 1;
}
