#pragma once

#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// load_map() of a verb that reads a map: warns on stderr as that says, and prints the map's origin if it has
/// one, since all coordinates are less this.
LoadedMap open_map(const std::string& name);

/// Whether a verb that reads one map and writes another writes over it.
bool writes_over(const std::string& read, const std::string& written);

/// load_map() of a verb that writes `output`: if that is the same map, a .bt that another tool has edited is
/// kept beside it. Warns on stderr as that says. Throws Error(output).
LoadedMap load_to_write(const std::string& name, const std::string& output);

}  // namespace octosurf
