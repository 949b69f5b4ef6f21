#pragma once

#include <filesystem>
#include <memory>
#include <octomap/OcTree.h>
#include <string>

// OctoMap's files and messages. Link octosurf::octomap. For conversions from and to maps see
// adapters/octree.hpp.

namespace octosurf {

/// Reads the octree of a `.bt` or `.ot`: node by node equal to the pruned result of OctoMap's readers.
/// Colours of a ColorOcTree are ignored. Throws Error(data) for a file that is missing, damaged or not an
/// octree, or that needs more than 32 MiB and 64 times its size; OctoMap's readers do not validate their
/// input. O(nodes).
std::unique_ptr<octomap::OcTree> read_octree(const std::filesystem::path& file);

/// Writes `tree` as OctoMap's `.ot` with OctoMap's writer: log-odds of all nodes, 5 B each; a `.bt`
/// (save_map()) has only occupied and free. The file is complete or absent. Throws Error(usage) if it exists
/// and not `force`, Error(output) if it cannot be written. O(nodes).
void write_ot(const octomap::OcTree& tree, const std::filesystem::path& file, bool force = false);

/// `data` of octomap_msgs/Octomap with `binary`, equal to octomap_msgs::binaryMapToMsg(), by OctoMap's
/// writer: occupied and free, two bits for each child of an inner node. Empty for an empty tree. O(nodes).
std::string octomap_message_data(const octomap::OcTree& tree);

}  // namespace octosurf
