#pragma once

#include <filesystem>

namespace octosurf {

/// Prints what is in a bag: topics, types, counts, first and last times. Throws Error(data) if it is damaged,
/// after what is whole was printed.
void print_bag(const std::filesystem::path& bag, bool json);

}  // namespace octosurf
