#pragma once

#include "detection/segmentation.hpp"
#include "surfaces/ledger.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// What is labelled around `due`, pending points: these, `touching` inliers, and all of surfaces that have
/// half of theirs in the same blocks of planelets as `due`. What is pending within h of these may join;
/// context are the inliers beside all that, on the last stretch of its rays, and at rims within h. Cost
/// follows what is given.
Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const geometry::VoxelKey> due,
                               std::span<const geometry::VoxelKey> touching);
/// The same around all inliers of some surfaces, and some of others.
Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const SurfaceId> surfaces,
                               std::span<const geometry::VoxelKey> inliers = {});

/// What is known of readings before they are looked at anew: the labels of their surfaces, but for those of
/// `forgotten`, and sums of what these have outside, their context among it. Inliers outside weigh as those
/// of their class of distance among the readings do, and were hit as often. `forgotten` must be among the
/// readings wholly, none of it as context. `unlabelled`: readings that begin without a label, too.
Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         std::span<const SurfaceId> forgotten,
                         std::span<const geometry::VoxelKey> unlabelled = {});

}  // namespace octosurf::detection
