#pragma once

#include "detection/readings.hpp"

#include <map>
#include <utility>
#include <vector>

namespace octosurf::detection {

/// Of each two planes that face alike, the rays that ended at one and passed through where the other has
/// readings, up to as far off as clutter is looked at; the smaller label comes first. Surfaces are opaque: if
/// both were there, hardly any ray would. O(readings).
std::map<std::pair<Label, Label>, double> count_crossings(const Readings& readings,
                                                          const std::vector<Label>& labels,
                                                          const std::vector<Patch>& patches);

}  // namespace octosurf::detection
