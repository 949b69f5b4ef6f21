#pragma once

#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// What `octosurf info --json` prints. `up`: of --up.
std::string info_json(const LoadedMap& loaded, const std::string& up);

}  // namespace octosurf
