#include "io/new_file.hpp"
#include "occupancy/occupancy_map.hpp"

#include <limits>
#include <sstream>

#include <octosurf/adapters/octomap_files.hpp>
#include <octosurf/adapters/octree.hpp>

namespace octosurf {

std::unique_ptr<octomap::OcTree> read_octree(const std::filesystem::path& file) {
  return to_octree(occupancy::OccupancyMap::read_octomap(file, {}).share());
}

void write_ot(const octomap::OcTree& tree, const std::filesystem::path& file, bool force) {
  io::write_file(file, force, [&](std::ostream& stream) {
    // OctoMap writes the resolution with the stream's precision: six digits would move voxels of 1/30 m.
    stream.precision(std::numeric_limits<double>::max_digits10);
    tree.write(stream);
  });
}

std::string octomap_message_data(const octomap::OcTree& tree) {
  std::ostringstream stream;
  tree.writeBinaryData(stream);
  return std::move(stream).str();
}

}  // namespace octosurf
