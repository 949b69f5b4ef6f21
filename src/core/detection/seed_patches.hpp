#pragma once

#include "detection/segmentation.hpp"

namespace octosurf::detection {

/// Edge of the smallest blocks searched for planes, in voxels: 8 cm, the smallest edge that a foot needs, and
/// at least four voxels, so that a block that a plane crosses has more readings than a plane has parameters.
int seed_patch_edge(double resolution);
inline constexpr int seed_patch_levels = 4;  ///< effort: block sizes, each with twice the edge

/// Planes through three readings tried at most before one is taken, as in the paper (III-C), and how sure it
/// is that the block's largest plane was among them when fewer are: with the share w of readings of the best
/// one so far, k trials draw three of its readings at least once with a probability of 1 − (1 − w³)ᵏ
/// (Fischler and Bolles 1981). As PCL's.
inline constexpr int seed_patch_trials = 200;
inline constexpr double seed_patch_certainty = 0.99;

/// Finds small initial planes by RANSAC (paper, III-C) among unlabelled readings that may seed: in blocks of
/// seed_patch_edge() the best of a least-squares plane and of planes through three readings each, by Σ
/// log_ratio over the readings that belong to it, repeated while one explains more than its description
/// costs. The rest goes to blocks of twice the edge, three times, for sparse readings or noise larger than
/// the block. New patches are appended. O(readings).
Segmentation with_seed_patches(const Readings& readings, Segmentation known);

}  // namespace octosurf::detection
