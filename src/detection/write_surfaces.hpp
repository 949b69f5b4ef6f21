#pragma once

#include "detection/detector.hpp"

namespace octosurf::detection {

/// Makes the map's surfaces those of a segmentation, as far as its readings and what is outside of them
/// reach. A surface goes on, with its id, in the label that has the most of its readings; if several do in
/// one, the one of which it has the most, and the others are merged into it. What is left has new ids, and
/// names the surface that had most of its readings as its parent. What later scans told of a plane goes on
/// where nine tenths of its surface's points do. Points that lose their surface are requeued. Costs follow
/// the points that change hands.
///
/// `found` must be on the ledger's window. `all`: each plane becomes the segmentation's; else those of
/// surfaces whose points have changed. Surfaces that are wholly among the readings have been checked.
enum class Planes { all, touched };
void write_surfaces(surfaces::Ledger& ledger, const Found& found, Planes planes);

}  // namespace octosurf::detection
