#pragma once

#include "detection/readings.hpp"

#include <map>
#include <utility>
#include <vector>

namespace octosurf::detection {

/// The last parts of rays before their end points, up to the depth in which clutter is counted. The readings
/// there are looked up on first use.
class Crossings {
 public:
  explicit Crossings(const Readings& readings)
      : readings_(readings), stretches_(readings.size_with_context()) {}

  /// For each two planes that face the same way, counts the rays that ended at one and passed through
  /// readings of the other; the smaller label comes first. Surfaces are opaque: if both existed, hardly any
  /// ray would pass. O(readings).
  std::map<std::pair<Label, Label>, double> count(const std::vector<Label>& labels,
                                                  const std::vector<Patch>& patches);

 private:
  using Index = Readings::Index;
  struct Stretch {
    std::uint32_t first = 0, count = 0;  // in passed_
    bool known = false;
  };
  const Stretch& stretch_of(Index end);

  const Readings& readings_;
  std::vector<Stretch> stretches_;  // of each reading
  std::vector<Index> passed_;
};

}  // namespace octosurf::detection
