#pragma once

#include <filesystem>
#include <string>

namespace octosurf::io {

/// Suffix of NewFile's temporary names: `.part-` and 16 random hexadecimal digits. Throws Error(output) if
/// the system has no random numbers.
std::string new_part_ending();

/// Removes temporary files of `file` left by terminated processes: regular files of this user beside it with
/// such a name, a single link, and a free lock. Files that cannot be examined or locked stay.
void remove_left_overs(const std::filesystem::path& file);

}  // namespace octosurf::io
