#pragma once

#include "detection/segmentation.hpp"
#include "surfaces/refusal.hpp"

#include <cstddef>
#include <vector>

#include <octosurf/parameters.hpp>

namespace octosurf::detection {

/// What the parameters demand of surfaces, beside the criterion.
struct SegmentLimits {
  double gap = 0.08;               ///< m, h: over which two patches may be one
  std::size_t fewest_points = 50;  ///< n
  double least_width = 0;          ///< m, across the narrow side
};
inline SegmentLimits limits_of(const Parameters& parameters) {
  return {parameters.max_hole_size(), static_cast<std::size_t>(parameters.min_surface_points()),
          parameters.surfaces.min_surface_width};
}

/// Readings of a plane that did not hold, and why; each later one outweighs those before.
struct Refused {
  surfaces::Refusal why;
  std::vector<Readings::Index> readings;
};

/// Segmentation: planelets of what has no label; three times merging, labels anew, connected pieces; then
/// what does not bend, is large enough, and explains more than its description costs and than rays through it
/// speak against is a surface, and what is left is clutter. The same readings give the same planes.
/// O(readings), 5 to 8 µs for each.
///
/// `known`: labels to begin with, of patches that refit_patches() has fitted; what is outside must have one.
/// Without, it is the batch form, and the slow twin of what goes scan by scan. `refused`: if given, what was
/// refused is added to it.
Segmentation segment(const Readings& readings, const SegmentLimits& limits, Segmentation known,
                     std::vector<Refused>* refused = nullptr);
Segmentation segment(const Readings& readings, const SegmentLimits& limits);

}  // namespace octosurf::detection
