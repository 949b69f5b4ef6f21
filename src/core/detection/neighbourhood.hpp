#pragma once

#include "detection/segmentation.hpp"
#include "surfaces/ledger.hpp"

#include <span>

namespace octosurf::detection {

/// The cells to label: `points`, cells, and all of `surfaces`. Pending cells within h of these are
/// candidates; context are cells of inliers beside all that, and on the last part of its rays. What a surface
/// has beyond a gap is none: expand() offers it. Cost is proportional to the input.
Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const PointId> points,
                               std::span<const SurfaceId> surfaces = {});

/// The initial segmentation of readings: the labels of their surfaces, except those of `forgotten`, and the
/// sums of these surfaces' other inliers, including context (patch_of()), seen and hit like their readings
/// here. All inliers of `forgotten` must be among the readings, none as context.
Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         std::span<const SurfaceId> forgotten);

}  // namespace octosurf::detection
