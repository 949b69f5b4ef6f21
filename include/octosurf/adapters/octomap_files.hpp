#pragma once

#include <filesystem>
#include <memory>
#include <octomap/OcTree.h>
#include <string>

// OctoMap's files and messages. Link octosurf::octomap. From and to maps: adapters/octree.hpp.

namespace octosurf {

/// The octree of a `.bt` or `.ot`: node by node what OctoMap's own readers make of it once it is pruned. A
/// ColorOcTree's colours are left out. Throws Error(data) for a file that is missing, damaged, foreign, or
/// takes more than 32 MiB and 64 times its size; OctoMap's readers trust their input instead. O(nodes).
std::unique_ptr<octomap::OcTree> read_octree(const std::filesystem::path& file);

/// Writes `tree` as OctoMap's `.ot`, by OctoMap's own writer: log-odds of all nodes, 5 B each, where a `.bt`
/// (save_map()) has occupied and free only. The file is complete or not there. Throws Error(usage) if it
/// exists and not `force`, Error(output) if it cannot be written. O(nodes).
void write_ot(const octomap::OcTree& tree, const std::filesystem::path& file, bool force = false);

/// `data` of octomap_msgs/Octomap with `binary`, as octomap_msgs::binaryMapToMsg() makes it, by OctoMap's own
/// writer: occupied and free, two bits for each child of an inner node. Empty for an empty tree. O(nodes).
std::string octomap_message_data(const octomap::OcTree& tree);

}  // namespace octosurf
