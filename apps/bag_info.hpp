#pragma once

#include <filesystem>

namespace octosurf {

/// Prints a bag's topics, types, counts, first and last times. For a damaged bag prints its readable part,
/// then throws Error(data).
void print_bag(const std::filesystem::path& bag, bool json);

}  // namespace octosurf
