#pragma once

#include "detection/readings.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Sums over a surface's points that are not among the readings.
struct Outside {
  SurfaceId surface = 0;
  Label label = clutter;  ///< its current label
  Patch sums;             ///< its plane is unused
};

/// The plane of each reading.
struct Segmentation {
  std::vector<Label> labels;                           ///< of each reading
  std::vector<Patch> patches = std::vector<Patch>(1);  ///< by label; the first is a placeholder for clutter
  std::vector<Outside> outside;                        ///< empty if the readings are all of the octree's
  std::vector<Readings::Index> too_few;                ///< readings of planes rejected for their number alone
  std::vector<std::vector<Readings::Index>> curved;  ///< readings of patches rejected as curved or too narrow

  /// Those of each label but clutter among the first `size` readings, the ones to be labelled.
  std::vector<std::vector<Readings::Index>> by_label(std::size_t size) const {
    std::vector<std::vector<Readings::Index>> of(patches.size());
    for (Readings::Index i = 0; i < size; ++i)
      if (labels[i] != clutter) of[labels[i]].push_back(i);
    return of;
  }
  /// Renames labels, and replaces the patches.
  void follow(std::span<const Label> into, std::vector<Patch> now) {
    for (Label& label : labels) label = into[label];
    for (Outside& part : outside) part.label = into[part.label];
    patches = std::move(now);
  }
};

/// By label, the sums outside.
inline std::vector<Patch> sums_outside(const Segmentation& segmentation) {
  std::vector<Patch> sums(segmentation.patches.size());
  for (const Outside& part : segmentation.outside) {
    Patch& sum = sums[part.label];
    sum.readings > 0 ? sum.add(part.sums) : void(sum = part.sums);
  }
  return sums;
}

}  // namespace octosurf::detection
