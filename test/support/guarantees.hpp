#pragma once

#include <string>

#include <octosurf/mapper.hpp>

namespace octosurf::test {

/// What the public headers promise of every surface, beside check_invariants(): slow.
void expect_guarantees(const Map& map);

/// Everything that decides how a map goes on, as bytes: equal maps, equal strings.
std::string digest(const Map& map);

}  // namespace octosurf::test
