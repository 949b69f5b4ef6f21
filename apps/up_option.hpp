#pragma once

#include <optional>
#include <string>

#include <octosurf/up.hpp>

namespace CLI {
class App;
}

namespace octosurf {

/// Adds --up to a verb that asks a map; what is given there wins over the map's own.
void add_up_option(CLI::App& verb, std::string& text);

/// Up in a map, `text` (of --up) first. Throws Error(usage) for text that is no direction.
Up up_in_force(const Map& map, const std::string& text);

/// The direction that surfaces clearly suggest in the place of the map's, where --up has no `text`.
std::optional<Up> suggested_up(const Map& map, const std::string& text);

/// Warns of it, to stderr.
void warn_of_up(const Map& map, const std::string& text);

/// "0.009 -0.905 -0.426, estimated from 12.3 m² of level surfaces", with a word of caution where it takes
/// one.
std::string describe(const Up& up);

}  // namespace octosurf
