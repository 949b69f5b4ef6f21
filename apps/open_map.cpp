#include "open_map.hpp"

#include "io/text_file.hpp"
#include "output_files.hpp"

#include <cstdio>

namespace octosurf {

LoadedMap load_with_warning(const std::string& name) {
  LoadedMap loaded = load_map(name);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  return loaded;
}

LoadedMap open_map(const std::string& name) {
  LoadedMap loaded = load_with_warning(name);
  if (const Eigen::Vector3d origin = loaded.map.origin(); !origin.isZero(0))
    std::fprintf(stderr, "origin: coordinates are less %s m, as those of the poses were too far from 0\n",
                 io::text_of(origin).c_str());
  return loaded;
}

bool writes_over(const std::string& read, const std::string& written) {
  return same_file(files_of_map(read).front(), files_of_map(written).front());
}

}  // namespace octosurf
