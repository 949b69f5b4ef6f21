#pragma once

#include <string_view>

namespace octosurf::io {

/// The page without its maps, as built by web/bundle.mjs; empty if that was not possible.
std::string_view page_template();

/// Placeholder for the maps, once in the template.
inline constexpr std::string_view page_maps_mark = "<!--octosurf:maps-->";

}  // namespace octosurf::io
