#pragma once

#include "alignment/alignment_state.hpp"
#include "alignment/near_surfaces.hpp"
#include "alignment/pose_search.hpp"
#include "sensing/noise_model.hpp"
#include "surfaces/map_state.hpp"

#include <cstddef>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// A scan aligned with a map, and what the map's record becomes once the scan is inserted.
struct AlignedScan {
  Alignment alignment;
  std::vector<sensing::SharedVariance> shared;  ///< of its readings' errors; none if the scan was rejected
  AlignmentState state;
  std::vector<SeenPatches::Change> patches;  ///< of the scan, updated
};

/// Aligns consecutive scans of a recording with the map that they build.
class ScanAligner {
 public:
  /// The pose for inserting `scan` into `map`: the given one unless alignment is enabled. A millisecond if
  /// not, else two, or twenty with a search.
  AlignedScan operator()(const surfaces::MapState& map, const Scan& scan, const RangeLimits& limits);

 private:
  // Caches alone: all that decides is in the map's record.
  NearSurfaces surfaces_, surfaces_around_;  ///< of searches within reach, and beyond
};

}  // namespace octosurf::alignment
