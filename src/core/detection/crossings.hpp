#pragma once

#include "detection/readings.hpp"

#include <map>
#include <utility>
#include <vector>

namespace octosurf::detection {

/// For each two planes that face the same way, counts the rays that ended at one and passed through readings
/// of the other, up to the depth in which clutter is counted; the smaller label comes first. Surfaces are
/// opaque: if both existed, hardly any ray would pass. O(readings).
std::map<std::pair<Label, Label>, double> count_crossings(const Readings& readings,
                                                          const std::vector<Label>& labels,
                                                          const std::vector<Patch>& patches);

}  // namespace octosurf::detection
