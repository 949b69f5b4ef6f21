#pragma once

#include <optional>
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

/// The direction that surfaces clearly suggest instead of the map's, if --up has no `text`.
std::optional<Up> suggested_up(const Map& map, const std::string& text);

/// Warns of it, to stderr.
void warn_of_up(const Map& map, const std::string& text);

/// "0.009 -0.905 -0.426, estimated from 12.3 m² of level surfaces", with a caution if it is ambiguous.
std::string describe(const Up& up);

}  // namespace octosurf
