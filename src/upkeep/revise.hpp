#pragma once

#include "surfaces/ledger.hpp"

namespace octosurf::upkeep {

/// Refits the touched surfaces' planes from their running moments (weights 1/σ²). Where a plane
/// has moved by more than a quarter of s since its inliers were last checked, they are checked
/// again and misfits go back to pending. Dissolves what falls below n. A surface that has changed by a
/// quarter is also checked for being one plane: if it bends, has become too narrow or is the noise of another
/// surface (soundness.hpp) it is dissolved, and Changes::unsound has the reason; if it is several planes it
/// is split (parts.hpp).
void refit(surfaces::Ledger& ledger);

}  // namespace octosurf::upkeep
