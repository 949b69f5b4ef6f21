#pragma once

#include "detection/segmentation.hpp"
#include "surfaces/refusal.hpp"

#include <cstddef>
#include <vector>

#include <octosurf/parameters.hpp>

namespace octosurf::detection {

/// Limits on surfaces from the parameters, besides the criterion.
struct SegmentLimits {
  double gap = 0.08;               ///< m, h: largest gap across which patches merge
  std::size_t fewest_points = 50;  ///< n
  double least_width = 0;          ///< m, across the narrow side
  bool see_through = true;         ///< rays through a plane speak against it
};
inline SegmentLimits limits_of(const Parameters& parameters) {
  return {parameters.max_hole_size(), static_cast<std::size_t>(parameters.min_surface_points()),
          parameters.surfaces.min_surface_width};
}

/// Readings of a rejected plane with the reason; later entries take precedence.
struct Refused {
  surfaces::Refusal why;
  std::vector<Readings::Index> readings;
};

/// Segments readings into planes, from seed patches: three rounds of merging, relabelling and splitting into
/// connected pieces; then a patch becomes a surface if it is not curved, is large enough, and
/// explains more than its description costs and than rays through it speak against it; the rest is clutter.
/// Deterministic. O(readings), 5 to 8 µs for each.
///
/// `known`: initial labels, of seed patches and of patches fitted by refit_patches(); sums outside must have
/// a label. Without it this is the batch form, with which tests compare the incremental one. `refused`: if
/// given, receives rejected planes.
Segmentation segment(const Readings& readings, const SegmentLimits& limits, Segmentation known,
                     std::vector<Refused>* refused = nullptr);
Segmentation segment(const Readings& readings, const SegmentLimits& limits);

}  // namespace octosurf::detection
