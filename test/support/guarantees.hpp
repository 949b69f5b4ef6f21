#pragma once

#include "support/invariants.hpp"

#include <array>
#include <cstdint>
#include <tuple>

#include <octosurf/mapper.hpp>

namespace octosurf::test {

/// What the public headers promise of every surface, beside check_invariants(): slow.
void expect_guarantees(const Map& map);

using Leaves = std::vector<std::tuple<std::array<std::uint16_t, 3>, int, float>>;
Leaves leaves_of(const Map& map);  ///< of its octree: corners, levels, log-odds

/// Everything that decides how a map goes on, as its file has it: equal maps, equal strings.
inline std::string digest(const Map& map) { return digest_of(map); }

}  // namespace octosurf::test
