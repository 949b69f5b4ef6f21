#pragma once

#include <filesystem>
#include <string>

namespace octosurf::io {

/// What NewFile puts behind a file's name while it is written: `.part-` and 16 random hexadecimal digits.
/// Throws Error(output) if the system has no random numbers.
std::string new_part_ending();

/// Removes the temporary files of `file` that a process which is no more has left: those beside it with such
/// a name that are plain files of this user with no other link to them, and whose lock is free. What cannot
/// be looked at or locked stays.
void remove_left_overs(const std::filesystem::path& file);

}  // namespace octosurf::io
