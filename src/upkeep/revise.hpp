#pragma once

#include "surfaces/scan_changes.hpp"

namespace octosurf {

/// Refits the touched surfaces' planes from their running moments (weights 1/σ²). Where a plane
/// has moved by more than a quarter of s since its inliers were last checked, they are checked
/// again and misfits go back to pending. Dissolves what falls below n. A surface that has changed by a
/// quarter is also asked again whether it is one: what bends, has become too narrow or is another's noise
/// (soundness.hpp) is dissolved, and Changes::unsound says why; what is several planes is split (parts.hpp).
void refit(Workspace& work);

}  // namespace octosurf
