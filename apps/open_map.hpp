#pragma once

#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// load_map() that warns on stderr as that says: of a verb that writes the map again.
LoadedMap load_with_warning(const std::string& name);

/// load_map() of a verb that reads a map: warns on stderr as that says, and prints the map's origin if it has
/// one, since all coordinates are less this.
LoadedMap open_map(const std::string& name);

/// Whether a verb that reads one map and writes another writes over it.
bool writes_over(const std::string& read, const std::string& written);

}  // namespace octosurf
