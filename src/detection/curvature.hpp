#pragma once

#include "detection/readings.hpp"

#include <span>

namespace octosurf::detection {

/// Whether readings of a patch are of something round, like the facet of a pillar: a quadratic surface
/// explains them better than the plane by more than its three parameters are worth (Bayes factor), and it
/// turns by over 0.2 rad over the patch. O(readings).
bool is_curved(const Readings& readings, const Patch& patch, std::span<const Readings::Index> indices);
/// Whether they are of round bars side by side or crossing, like a ladder's front, which is no rounder than a
/// floor in all: the readings in each block of planelet_edge() fall away across the block's own narrow
/// direction, by one bend for all blocks, likelier than nine to one. O(readings log readings).
bool is_curved_in_places(const Readings& readings, const Patch& patch,
                         std::span<const Readings::Index> indices);

}  // namespace octosurf::detection
