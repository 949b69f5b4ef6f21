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
  struct Result {
    Alignment alignment;
    /// How far readings lie off the map's surfaces with which they are inserted; none of a scan that does not
    /// fit the map.
    std::vector<sensing::NoiseModel::Residual> residuals;
  };
  /// The pose with which to insert `scan`; `state` is brought forward by it. `map` is the `growing` map's
  /// snapshot. Two milliseconds, ten times as much for a scan that has to be looked for.
  Result operator()(surfaces::AlignmentState& state, const Snapshot& map, const GrowingMap& growing,
                    const Scan& scan, const RangeLimits& limits);
  /// The same of a scan that is inserted as given. One millisecond.
  Result as_given(const surfaces::AlignmentState& state, const Snapshot& map, const GrowingMap& growing,
                  const Scan& scan, const RangeLimits& limits);

 private:
  PoseSearch search(const Eigen::Isometry3d& start, const surfaces::AlignmentState& state,
                    const Snapshot& map, const GrowingMap& growing, const Scan& scan,
                    const RangeLimits& limits);

  NearSurfaces surfaces_;
};

}  // namespace octosurf::alignment
