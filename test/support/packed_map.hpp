#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace octosurf::test {

/// The records of a map file, footer left out; empty if it is none.
std::vector<std::string> records_of(std::string_view file);

/// A map file of the newest version with these records, and with a footer that is true of them or none.
std::string map_file_of(const std::vector<std::string>& records, bool with_footer = true);

}  // namespace octosurf::test
