#pragma once

#include "detection/junctions.hpp"
#include "detection/patch_graph.hpp"

#include <vector>

namespace octosurf::detection {

/// Adds the contacts between the patches of `labels`: every pair of neighbouring readings with two labels,
/// except ambiguous ones and those separated by a plane.
void meet_neighbours(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions,
                     PatchGraph& graph);

/// Adds contacts of separate patches across a gap of at most `reach` m, if most of the lines between their
/// boundaries are open: their ends are not separated by a plane, and no other reading lies on the lines or
/// just above, beyond the noise of the plane. Such readings belong to objects on the plane, such as a board,
/// that hide it.
void meet_across_gaps(const Readings& readings, const std::vector<Label>& labels, const Junctions& junctions,
                      double reach, PatchGraph& graph);

}  // namespace octosurf::detection
