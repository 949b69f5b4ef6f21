#include "open_map.hpp"

#include "io/map_file/map_file.hpp"
#include "io/text_file.hpp"
#include "output_files.hpp"

#include <cstdio>

namespace octosurf {
namespace {

void warn_of(const LoadedMap& loaded) {
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
}

}  // namespace

LoadedMap open_map(const std::string& name) {
  LoadedMap loaded = load_map(name);
  warn_of(loaded);
  if (const Eigen::Vector3d origin = loaded.map.origin(); !origin.isZero(0))
    std::fprintf(stderr, "origin: coordinates are less %s m, as those of the poses were too far from 0\n",
                 io::text_of(origin).c_str());
  return loaded;
}

bool writes_over(const std::string& read, const std::string& written) {
  return same_file(files_of_map(read).front(), files_of_map(written).front());
}

LoadedMap load_to_write(const std::string& name, const std::string& output) {
  LoadedMap loaded = load_map(name);
  if (writes_over(name, output)) io::set_aside_edited_octree(loaded, output);
  warn_of(loaded);
  return loaded;
}

}  // namespace octosurf
