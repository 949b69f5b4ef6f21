#pragma once

#include "surfaces/ledger.hpp"

#include <memory>

namespace octosurf::update {

/// Recomputes the stale parts of the touched surfaces. Returns the next snapshot: the last one with the
/// changes. Cost follows the change, except for the copy of pointers to all surfaces; polygons are left to
/// whoever reads it. `inliers_alone`: outlines use the inliers only (paper, IV-A), and are made here; else
/// also the end points of readings and intersections of surfaces. `threads` share the surfaces; the result
/// does not depend on them.
std::shared_ptr<const surfaces::Published::State> derive(surfaces::MapState& state,
                                                         const surfaces::Changes& changes, bool inliers_alone,
                                                         int threads);

}  // namespace octosurf::update
