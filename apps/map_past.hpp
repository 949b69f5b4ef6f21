#pragma once

#include "io/map_file/past.hpp"

#include <optional>
#include <string>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf {

/// As load_map, and of NAME@DATE the map as it was at the end of that day, minute or second, UTC, or of
/// NAME@K after its K-th session, as `octosurf log` counts them. Throws Error(usage) if it has no such
/// session.
LoadedMap load_map_at(const std::string& name);

/// Adds a run to the past of a map that was just saved; `stamp_s`: of its last scan. The map does without:
/// what fails is a warning.
void keep_session(io::PastKeeper& past, const Map& map, std::optional<double> stamp_s);

/// Saves a map as a session of the one that is there, if it began as that one; else says whose past ends.
void save_session(const Map& map, const std::string& output, const std::vector<std::string>& begun_as = {},
                  std::optional<double> stamp_s = {}, const KeptScans& kept = {});

/// UTC, as in 2026-11-27T09:30:00Z.
std::string date_text(double date_s);

}  // namespace octosurf
