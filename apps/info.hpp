#pragma once

#include <filesystem>
#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// What `octosurf info --json` prints. `up`: of --up.
std::string info_json(const LoadedMap& loaded, const std::string& up);

/// Prints a bag's topics, types, counts, first and last times. For a damaged bag prints its readable part,
/// then throws Error(data).
void print_bag(const std::filesystem::path& bag, bool json);

}  // namespace octosurf
