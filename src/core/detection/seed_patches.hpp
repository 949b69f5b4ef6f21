#pragma once

#include "detection/segmentation.hpp"

namespace octosurf::detection {

/// Edge of the smallest blocks searched for planes, in voxels: 8 cm, the smallest edge that a foot needs, and
/// at least four voxels, so that a block that a plane crosses has more readings than a plane has parameters.
int seed_patch_edge(double resolution);
inline constexpr int seed_patch_levels = 4;  ///< effort: block sizes, each with twice the edge

/// Planes through three readings tried before one is taken. Effort: where three planes share a block equally,
/// one triple in nine lies within one of them, and at least one of this many does with a probability of 94 %
/// (Fischler and Bolles 1981: ln(1 − 0.94) / ln(1 − 1/9)). Missed planes are found in the larger block, or
/// join their neighbours.
inline constexpr int seed_patch_trials = 24;

/// Finds small initial planes by RANSAC (paper, III-C) among unlabelled readings that may seed: in blocks of
/// seed_patch_edge() the best of a least-squares plane and of planes through three readings each, by Σ
/// log_ratio over the readings that belong to it, repeated while one explains more than its description
/// costs. The rest goes to blocks of twice the edge, three times, for sparse readings or noise larger than
/// the block. New patches are appended. O(readings).
Segmentation with_seed_patches(const Readings& readings, Segmentation known, int trials = seed_patch_trials);

}  // namespace octosurf::detection
