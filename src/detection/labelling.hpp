#pragma once

#include "detection/junctions.hpp"

#include <vector>

namespace octosurf::detection {

/// Gives each reading the label among its neighbours' that explains it best: the highest log_ratio, clutter
/// having 0, less rim_cost for each neighbour with another label (iterated conditional modes, Besag 1986).
/// Those at the border keep theirs. O(readings), a few times.
void relabel(const Readings& readings, const std::vector<Patch>& patches, std::vector<Label>& labels);

/// Makes a patch of each connected piece of a label, fitted anew; pieces of less readings than a plane needs
/// become clutter. Neighbours are connected unless one is ambiguous or something parts them. What reaches the
/// border is held to be connected with what is outside. Labels are those of the pieces then. O(readings).
void part_into_pieces(const Readings& readings, const Junctions& junctions, Segmentation& segmentation);

/// Fits each patch to the readings with its label, without ambiguous ones where enough are left, and to what
/// is outside.
void refit_patches(const Readings& readings, const Junctions& junctions, Segmentation& segmentation);

}  // namespace octosurf::detection
