#include "open_map.hpp"

#include "io/text_file.hpp"

#include <cstdio>
#include <utility>

namespace octosurf {

LoadedMap open_map(const std::string& name) {
  LoadedMap loaded = load_map(name);
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  if (const Eigen::Vector3d origin = loaded.map.origin(); !origin.isZero(0))
    std::fprintf(stderr, "origin: coordinates are less %s m, as those of the poses were too far from 0\n",
                 io::text_of(origin).c_str());
  return loaded;
}

}  // namespace octosurf
