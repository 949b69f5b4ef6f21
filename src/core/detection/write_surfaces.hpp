#pragma once

#include "detection/detector.hpp"

namespace octosurf::detection {

/// Applies a segmentation to the map's surfaces, within its readings and the sums outside. A surface keeps
/// its id in the label with most of its readings; if several surfaces share a label, the one with most
/// readings stays and the others merge into it. Other labels get new ids, and the surface that had most of
/// their readings as parent. Evidence of later scans is kept where nine tenths of a surface's points are.
/// Points that lose their surface are requeued. Cost: the reassigned points.
///
/// `found` must be on the ledger's window. `all`: each plane becomes the segmentation's; else only those of
/// surfaces whose points have changed. Surfaces entirely among the readings are marked as checked.
enum class Planes { all, touched };
void write_surfaces(surfaces::Ledger& ledger, const FoundPlanes& found, Planes planes);

}  // namespace octosurf::detection
