#pragma once

#include "detection/constants.hpp"
#include "detection/patch_graph.hpp"

#include <algorithm>
#include <boost/container/small_vector.hpp>

namespace octosurf::detection {

/// Counts the labels, or the ids of surfaces, among the neighbours of a reading.
template <class Id = Label>
class NeighbourLabels {
 public:
  void add(Id label, int readings = 1) {
    const auto at = std::find_if(counts_.begin(), counts_.end(),
                                 [label](const Count& count) { return count.label == label; });
    if (at == counts_.end())
      counts_.push_back({label, readings});
    else
      at->readings += readings;
  }
  struct Count {
    Id label;
    int readings;
  };
  auto begin() const { return counts_.begin(); }
  auto end() const { return counts_.end(); }
  int of(Id label) const {
    for (const Count& count : counts_)
      if (count.label == label) return count.readings;
    return 0;
  }

  /// The label that explains the reading best: the highest log_ratio(label) (0 for clutter) less
  /// boundary_cost for each neighbour with another label.
  template <class LogRatio>
  Id best(LogRatio&& log_ratio) const {
    // boundary_cost of all neighbours is common to all candidates; agreeing ones add it back.
    Id best = clutter;
    double most = Constants::boundary_cost * of(clutter);
    for (const auto& [label, agreeing] : counts_) {
      if (label == clutter) continue;
      const double gain = log_ratio(label) + Constants::boundary_cost * agreeing;
      if (gain <= most) continue;
      most = gain;
      best = label;
    }
    return best;
  }

 private:
  boost::container::small_vector<Count, 8> counts_;
};

}  // namespace octosurf::detection
