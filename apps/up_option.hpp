#pragma once

#include <string>

#include <octosurf/up.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Adds --up to a verb that queries a map; it overrides the map's own.
void add_up_option(CLI::App& verb, std::string& text);

/// A map's up direction, overridden by `text` (of --up). Throws Error(usage) for an invalid direction.
Up up_in_force(const Map& map, const std::string& text);

/// Warns on stderr where surfaces and the way the sensors were held agree on another direction than the
/// map's.
void warn_of_up(const Map& map);

/// "0.009 -0.905 -0.426, estimated from level surfaces".
std::string describe(const Up& up);

}  // namespace octosurf
