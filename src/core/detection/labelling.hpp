#pragma once

#include "detection/junctions.hpp"

#include <vector>

namespace octosurf::detection {

/// Gives each reading the label among its neighbours' that explains it best: the highest log_ratio (0 for
/// clutter) less boundary_cost for each neighbour with another label (iterated conditional modes, Besag
/// 1986). Labels at the border are fixed. O(readings), a few times.
void relabel(const Readings& readings, const std::vector<Patch>& patches, std::vector<Label>& labels);

/// Makes a refitted patch of each connected piece of a label; pieces with fewer readings than a plane needs
/// become clutter. Neighbours are connected unless one is ambiguous or a plane separates them. Readings at
/// the border count as connected with the part outside. Labels then index the pieces. O(readings).
void part_into_pieces(const Readings& readings, const Junctions& junctions, Segmentation& segmentation);

/// Fits each patch to the readings with its label and its sums outside, without ambiguous readings if enough
/// others are left.
void refit_patches(const Readings& readings, const Junctions& junctions, Segmentation& segmentation);

}  // namespace octosurf::detection
