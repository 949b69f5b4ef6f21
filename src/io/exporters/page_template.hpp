#pragma once

#include <string_view>

namespace octosurf::io {

/// The page without its map, as built by web/bundle.mjs; empty if that was not possible.
std::string_view page_template();

/// Placeholder for the map, once in the template.
inline constexpr std::string_view page_map_mark = "<!--octosurf:map-->";

}  // namespace octosurf::io
