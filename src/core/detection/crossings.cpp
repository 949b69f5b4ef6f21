#include "detection/crossings.hpp"

#include "detection/constants.hpp"

#include <algorithm>

namespace octosurf::detection {
namespace {

using Index = Readings::Index;

/// The last part of a ray before its end point.
class LastStretch {
 public:
  LastStretch(const Readings& readings, const std::vector<Label>& labels, const std::vector<Patch>& patches)
      : readings_(readings), labels_(labels), patches_(patches) {}

  /// The labels of planes that face the same way as the one at its end, each once.
  const std::vector<Label>& passed(Index end) {
    passed_.clear();
    const Reading& reading = readings_[end];
    const Plane& own = patches_[labels_[end]].plane;
    const int steps = static_cast<int>(sensing::ReadingModel::clutter_depth / 2 / readings_.resolution());
    for (int k = 1; k <= steps; ++k) {
      geometry::VoxelKey key;
      const Eigen::Vector3f at =
          reading.position + static_cast<float>(k * readings_.resolution()) * reading.view;
      if (!readings_.grid().key_of(at, key)) break;
      const Index there = readings_.find(key);
      if (there == Readings::none) continue;
      const Label label = labels_[there];
      if (label == clutter || label == labels_[end]) continue;
      if (own.normal.dot(patches_[label].plane.normal) < Constants::cos_nearly_parallel) continue;
      if (std::find(passed_.begin(), passed_.end(), label) == passed_.end()) passed_.push_back(label);
    }
    return passed_;
  }

 private:
  const Readings& readings_;
  const std::vector<Label>& labels_;
  const std::vector<Patch>& patches_;
  std::vector<Label> passed_;
};

}  // namespace

std::map<std::pair<Label, Label>, double> count_crossings(const Readings& readings,
                                                          const std::vector<Label>& labels,
                                                          const std::vector<Patch>& patches) {
  std::map<std::pair<Label, Label>, double> crossings;
  LastStretch stretch(readings, labels, patches);
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    if (labels[i] == clutter) continue;
    for (const Label label : stretch.passed(i)) crossings[std::minmax(label, labels[i])] += readings[i].hits;
  }
  return crossings;
}

}  // namespace octosurf::detection
