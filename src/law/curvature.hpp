#pragma once

#include "law/readings.hpp"

#include <span>

namespace octosurf::law {

/// Whether readings of a patch are of something round, like the facet of a pillar: a quadratic surface
/// explains them better than the plane by more than its three parameters are worth (Bayes factor), and it
/// turns by over 0.2 rad over the patch. O(readings).
bool is_curved(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices);

}  // namespace octosurf::law
