#pragma once

#include "surfaces/map_state.hpp"

#include <memory>
#include <set>

namespace octosurf {

/// Recomputes what is stale of the touched surfaces, and of those never published. Returns the next snapshot,
/// for whoever publishes it.
std::shared_ptr<const Snapshot> derive(MapState& state, const std::set<SurfaceId>& touched);

}  // namespace octosurf
