#pragma once

#include "surfaces/ledger.hpp"

#include <memory>

namespace octosurf::upkeep {

/// Recomputes what is stale of the touched surfaces. Returns the next snapshot, for whoever publishes it: the
/// last one with what has changed. Cost follows the change, but for the copy of pointers to all surfaces.
/// `inliers_alone`: outlines are those of the inliers (paper, IV-A); else they end where readings end and
/// where surfaces meet. The same whatever `threads` is, which share the surfaces.
std::shared_ptr<const Snapshot> derive(surfaces::MapState& state, const surfaces::Changes& changes,
                                       bool inliers_alone, int threads);

}  // namespace octosurf::upkeep
