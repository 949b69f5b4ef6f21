#pragma once

#include "detection/readings.hpp"

#include <span>

namespace octosurf::detection {

/// Whether a patch is curved, like a facet of a pillar: a quadratic surface is preferred to the plane by a
/// Bayes factor over its three additional parameters, and it turns by over 0.2 rad over the patch.
/// O(readings).
bool is_curved(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices);
/// Whether the readings are of round bars side by side or crossing, such as a ladder's front, which is flat
/// as a whole: in each block of seed_patch_edge() they curve away across the block's narrow direction, with
/// one curvature for all blocks, at odds of more than nine to one. O(readings log readings).
bool is_curved_in_places(const Readings& readings, const Patch& patch,
                         std::span<const Readings::Index> indices);

}  // namespace octosurf::detection
