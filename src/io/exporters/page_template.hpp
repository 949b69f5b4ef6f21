#pragma once

#include <string_view>

namespace octosurf::io {

/// The page without its maps, as web/bundle.mjs makes it while building; empty if that was not possible.
std::string_view page_template();

/// Where the maps go, once in the template.
inline constexpr std::string_view page_maps_mark = "<!--octosurf:maps-->";

}  // namespace octosurf::io
