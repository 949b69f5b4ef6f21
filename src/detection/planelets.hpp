#pragma once

#include "detection/segmentation.hpp"

namespace octosurf::detection {

/// Edge of the smallest blocks in which planes are looked for, in voxels: 8 cm, what a foot's edge needs, and
/// at least four voxels, so that a block that a plane crosses holds more readings than a plane has
/// parameters.
int planelet_edge(double resolution);
inline constexpr int planelet_levels = 4;  ///< effort: of blocks, each of twice the edge

/// Small planes to begin with, by RANSAC (paper, III-C), of readings that have no label and may seed: in
/// blocks of planelet_edge() the best of a least-squares plane and of planes through three readings each, by
/// Σ log_ratio over what belongs to it, again and again while one explains more than its description costs;
/// what is left goes to blocks of twice the edge, three times, where readings are sparse or noise is larger
/// than the block. Their patches follow those that are there. O(readings).
void find_planelets(const Readings& readings, Segmentation& segmentation);

}  // namespace octosurf::detection
