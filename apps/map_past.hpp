#pragma once

#include <cstdint>
#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// As load_map, and of NAME@DATE the map as it was at the end of that day, minute or second, UTC, or of
/// NAME@K after its K-th session, as `octosurf log` counts them. Throws Error(usage) if it has no such
/// session.
LoadedMap load_map_at(const std::string& name);

/// UTC, as in 2026-11-27T09:30:00Z.
std::string date_text(double date_s);

}  // namespace octosurf
