#pragma once

#include "detection/junctions.hpp"
#include "detection/patch_graph.hpp"

#include <vector>

namespace octosurf::detection {

/// Where the patches of `labels` meet: every pair of neighbouring readings with two labels, but for ambiguous
/// ones and those that something parts.
void meet_neighbours(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions,
                     PatchGraph& graph);

/// Patches that do not touch meet across a gap of at most `reach` m, if most of the lines between their rims
/// are open: nothing parts their ends, and no reading of anything else stands on them, nor just above, beyond
/// the reach of the plane's own noise, as those of a board do that stands on the plane and hides what is
/// under it.
void meet_across_gaps(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions,
                      double reach, PatchGraph& graph);

}  // namespace octosurf::detection
