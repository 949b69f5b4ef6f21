#pragma once

#include "alignment/drift_filter.hpp"
#include "alignment/near_surfaces.hpp"
#include "alignment/pose_search.hpp"
#include "sensing/noise_model.hpp"

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Aligns one scan after the other of a recording to the map that they build.
class ScanAligner {
 public:
  /// The pose with which to insert `scan`; `state` is brought forward by it. `map` is the `growing` map's
  /// snapshot. Two milliseconds, ten times as much for a scan that has to be looked for.
  Alignment operator()(surfaces::AlignmentState& state, const Snapshot& map, const GrowingMap& growing,
                       const Scan& scan, const RangeLimits& limits);

 private:
  NearSurfaces surfaces_;
};

}  // namespace octosurf::alignment
