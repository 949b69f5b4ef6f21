#pragma once

#include "surfaces/ledger.hpp"

#include <memory>

namespace octosurf {

/// Recomputes what is stale of the touched surfaces. Returns the next snapshot, for whoever publishes it: the
/// last one with what has changed. Cost follows the change, but for the copy of pointers to all surfaces.
std::shared_ptr<const Snapshot> derive(MapState& state, const Changes& changes);

}  // namespace octosurf
