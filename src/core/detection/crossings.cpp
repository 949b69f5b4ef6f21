#include "detection/crossings.hpp"

#include "detection/constants.hpp"

#include <algorithm>

namespace octosurf::detection {

const Crossings::Stretch& Crossings::stretch_of(Index end) {
  Stretch& stretch = stretches_[end];
  if (stretch.known) return stretch;
  stretch = {.first = static_cast<std::uint32_t>(passed_.size()), .count = 0, .known = true};
  const Reading& reading = readings_[end];
  const double d = readings_.resolution();
  const int steps = static_cast<int>(sensing::ReadingModel::clutter_depth / 2 / d);
  for (int k = 1; k <= steps; ++k) {
    geometry::VoxelKey key;
    if (!readings_.grid().key_of(reading.position + static_cast<float>(k * d) * reading.view, key)) break;
    if (const Index there = readings_.find(key); there != Readings::none) passed_.push_back(there);
  }
  stretch.count = static_cast<std::uint32_t>(passed_.size()) - stretch.first;
  return stretch;
}

std::map<std::pair<Label, Label>, double> Crossings::count(const std::vector<Label>& labels,
                                                           const std::vector<Patch>& patches) {
  std::map<std::pair<Label, Label>, double> crossings;
  std::vector<Label> passed;  // by one ray, each once
  for (Index i = 0; i < readings_.size_with_context(); ++i) {
    if (labels[i] == clutter) continue;
    passed.clear();
    const Plane& own = patches[labels[i]].plane;
    const Stretch& stretch = stretch_of(i);
    for (std::uint32_t k = stretch.first; k < stretch.first + stretch.count; ++k) {
      const Label label = labels[passed_[k]];
      if (label == clutter || label == labels[i]) continue;
      if (own.normal.dot(patches[label].plane.normal) < Constants::cos_nearly_parallel) continue;
      if (std::find(passed.begin(), passed.end(), label) == passed.end()) passed.push_back(label);
    }
    for (const Label label : passed) crossings[std::minmax(label, labels[i])] += readings_[i].hits;
  }
  return crossings;
}

}  // namespace octosurf::detection
