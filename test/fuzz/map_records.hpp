#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::fuzz {

/// The records of a map file, footer left out; empty if it is none.
std::vector<std::string> records_of(std::string_view file);

/// A map file of the newest version with these records and a footer that is true of them.
std::string map_file_of(const std::vector<std::string>& records);

/// Another file of the kind, with a right checksum: what is behind the checksum is what `mutate` comes to.
/// `mutate(bytes)` changes a string in some way; `seed` decides everything else.
std::string mutated_map(std::string_view file, unsigned seed,
                        const std::function<void(std::string&)>& mutate);

}  // namespace octosurf::fuzz
