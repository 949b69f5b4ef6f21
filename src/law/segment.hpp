#pragma once

#include "law/readings.hpp"

#include <vector>

namespace octosurf::law {

/// What a user asks of surfaces, beside the law.
struct SegmentLimits {
  double gap = 0.08;               ///< m, h: over which two patches may be one
  std::size_t fewest_points = 50;  ///< n
  double least_width = 0;          ///< m, across the narrow side
};

/// The planes of all readings.
struct Segmentation {
  std::vector<Label> labels;   ///< of each reading
  std::vector<Patch> patches;  ///< by label; the first stands for clutter
};

/// The law's batch form, and the slow twin of any that goes scan by scan: planelets; three times merging,
/// labels anew, connected pieces; then what does not bend, is large enough, and explains more than its
/// description costs and than rays through it speak against is a surface, and what is left is clutter. The
/// same readings give the same planes. O(readings), 5 to 8 µs for each.
Segmentation segment(const Readings& readings, const SegmentLimits& limits);

}  // namespace octosurf::law
