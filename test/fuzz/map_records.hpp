#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace octosurf::fuzz {

/// Another map file of the kind of `file`, with a right checksum: what is behind the checksum is what
/// `mutate` comes to. `mutate(bytes)` changes a string in some way; `seed` decides everything else.
std::string mutated_map(std::string_view file, unsigned seed,
                        const std::function<void(std::string&)>& mutate);

}  // namespace octosurf::fuzz
