#pragma once

#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// load_map() of a verb that asks a map: warns on stderr as that says, and tells the map's origin if it has
/// one, since all coordinates are less this.
LoadedMap open_map(const std::string& name);

}  // namespace octosurf
