#pragma once

#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// load_map() of a verb that reads a map: warns on stderr as that says, and prints the map's origin if it has
/// one, since all coordinates are less this.
LoadedMap open_map(const std::string& name);

}  // namespace octosurf
