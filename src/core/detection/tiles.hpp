#pragma once

#include "sensing/reading_model.hpp"
#include "surfaces/surface_model.hpp"

#include <vector>

namespace octosurf::detection {

/// The inliers of a surface where its tiles disagree, in key order: in a tile of its plane hash, in a square
/// of 2 × 2, 4 × 4, … of them, or in a half, that is not one plane with the rest by the merge criterion on
/// sums. Empty if the surface is one plane; if it is curved or two, the inliers of a part. Cost: 20 ns for
/// each inlier and size, and sorting them.
std::vector<geometry::VoxelKey> where_tiles_disagree(const surfaces::SurfaceModel& surface,
                                                     const sensing::ReadingModel& model);

}  // namespace octosurf::detection
