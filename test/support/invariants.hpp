#pragma once

#include <string>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf::test {

/// Checks the map's invariants (docs/design.md §3): one line per violation, empty if all are met. Cost: one
/// pass over octree and surfaces.
std::vector<std::string> check_invariants(const Map& map);

}  // namespace octosurf::test
