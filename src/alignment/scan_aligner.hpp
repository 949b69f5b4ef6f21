#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_search.hpp"
#include "sensing/noise_model.hpp"
#include "surfaces/alignment_state.hpp"
#include "surfaces/seen_patches.hpp"

#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Aligns one scan after the other of a recording to the map that they build.
class ScanAligner {
 public:
  struct Result {
    Alignment alignment;
    /// How far readings lie off the map's surfaces with which they are inserted; none of a scan set aside.
    std::vector<sensing::NoiseModel::Residual> residuals;
    std::vector<surfaces::SeenPatches::Change> patches;  ///< what is to be remembered of the scan
  };
  /// The pose with which to insert `scan`; `state` is brought forward by it. `map` is the `growing` map's
  /// snapshot. Two milliseconds, ten times as much for a scan that has to be looked for.
  Result operator()(surfaces::AlignmentState& state, const surfaces::SeenPatches& patches,
                    const Snapshot& map, const GrowingMap& growing, const Scan& scan,
                    const RangeLimits& limits, const Eigen::Vector3d& up);
  /// The same of a scan that is inserted as given. One millisecond.
  Result as_given(const Snapshot& map, const GrowingMap& growing, const Scan& scan,
                  const RangeLimits& limits);

 private:
  PoseSearch search(const Eigen::Isometry3d& start, const Snapshot& map, const GrowingMap& growing,
                    const Scan& scan, const RangeLimits& limits);

  NearSurfaces surfaces_;
};

}  // namespace octosurf::alignment
