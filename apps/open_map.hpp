#pragma once

#include "planning/questions.hpp"

#include <string>

#include <octosurf/map.hpp>
#include <octosurf/up.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// load_map() that warns on stderr as that says: of a verb that writes the map again.
LoadedMap load_with_warning(const std::string& name);

/// load_map() of a verb that reads a map: warns on stderr as that says, and prints the map's origin if it has
/// one, since all coordinates are less this.
LoadedMap open_map(const std::string& name);

/// Whether a verb that reads one map and writes another writes over it.
bool writes_over(const std::string& read, const std::string& written);

/// Adds --up to a verb that queries a map; it overrides the map's own.
void add_up_option(CLI::App& verb, std::string& text);

/// A map's up direction, overridden by `text` (of --up). Throws Error(usage) for an invalid direction.
Up up_in_force(const Map& map, const std::string& text);
/// For queries, as it is now. `name`: of its errors; `up`: of --up.
planning::AskedMap asked_map(const LoadedMap& loaded, const std::string& name, const std::string& up);

/// Warns on stderr where surfaces and the way the sensors were held agree on another direction than the
/// map's.
void warn_of_up(const Map& map);

/// "0.009 -0.905 -0.426, estimated from level surfaces".
std::string describe(const Up& up);

}  // namespace octosurf
