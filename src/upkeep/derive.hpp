#pragma once

#include "surfaces/ledger.hpp"

#include <memory>

namespace octosurf::upkeep {

/// Recomputes what is stale of the touched surfaces. Returns the next snapshot, for whoever publishes it: the
/// last one with what has changed. Cost follows the change, but for the copy of pointers to all surfaces.
std::shared_ptr<const Snapshot> derive(surfaces::MapState& state, const surfaces::Changes& changes);

}  // namespace octosurf::upkeep
