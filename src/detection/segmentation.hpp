#pragma once

#include "detection/readings.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// What a surface has beside its points among the readings, as sums.
struct Outside {
  SurfaceId surface = 0;
  Label label = clutter;  ///< whose it is now
  Patch sums;             ///< its plane means nothing
};

/// Whose plane each reading is.
struct Segmentation {
  std::vector<Label> labels;                           ///< of each reading
  std::vector<Patch> patches = std::vector<Patch>(1);  ///< by label; the first stands for clutter
  std::vector<Outside> outside;                        ///< none if the readings are all of the octree's
  std::vector<Readings::Index> too_few;                ///< of planes refused for their number alone

  /// Each label becomes another, of these patches.
  void follow(std::span<const Label> into, std::vector<Patch> now) {
    for (Label& label : labels) label = into[label];
    for (Outside& part : outside) part.label = into[part.label];
    patches = std::move(now);
  }
};

/// By label, what is outside.
inline std::vector<Patch> sums_outside(const Segmentation& segmentation) {
  std::vector<Patch> sums(segmentation.patches.size());
  for (const Outside& part : segmentation.outside) {
    Patch& sum = sums[part.label];
    sum.readings > 0 ? sum.add(part.sums) : void(sum = part.sums);
  }
  return sums;
}

}  // namespace octosurf::detection
