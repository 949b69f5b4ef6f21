#pragma once

#include "law/segmentation.hpp"
#include "surfaces/ledger.hpp"

#include <span>
#include <vector>

namespace octosurf::law {

/// All points in the blocks of planelets that hold one of `changed`, or an inlier of one of `surfaces`, or of
/// a surface that has a quarter of its inliers in these. Of the blocks around, as far as patches meet, the
/// pending ones follow, and inliers are context, which is most. Cost follows what is given.
Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const geometry::VoxelKey> changed,
                               std::span<const SurfaceId> surfaces);

/// What is known of readings before they are looked at anew: the labels of their surfaces, but for those of
/// `forgotten`, and sums of what these have outside, their context among it. Inliers outside weigh as those
/// of their class of distance among the readings do, and were hit as often. `forgotten` must be among the
/// readings wholly, none of it as context.
Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         std::span<const SurfaceId> forgotten);

}  // namespace octosurf::law
