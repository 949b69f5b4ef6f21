#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::mapper {

/// Scans in a row at which the recording's poses stop meeting what was mapped before.
struct LoopClosure {
  std::string first, last;  ///< names of scans
  double farthest_m = 0;    ///< that the correction changed by, at the place of the sensor
};

/// Tells loops that close on a bent map from single poses that jump.
///
/// A scan is a closure if its correction differs by more than a voxel, at the place of the sensor, from the
/// last one that held, and if the next scan lies there, too: its correction is nearer to this scan's than to
/// that one. After a single jump the next correction is the earlier one again. The last scan has no next, so
/// it is none.
class LoopClosures {
 public:
  void add(const Scan& scan, const Alignment& alignment, double resolution);
  const std::vector<LoopClosure>& all() const { return all_; }

 private:
  struct Step {
    std::string scan;
    double distance_m = 0;
    Eigen::Isometry3d correction;  ///< in the map frame
  };
  void note(const Step& step);

  Eigen::Isometry3d lasting_ = Eigen::Isometry3d::Identity();  ///< correction of a scan that did not jump
  std::optional<Step> step_;                                   ///< of the last scan
  std::uint64_t scans_ = 0, end_of_last_ = 0;
  std::vector<LoopClosure> all_;
};

}  // namespace octosurf::mapper
