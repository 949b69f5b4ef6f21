#pragma once

#include "alignment/seen_patches.hpp"
#include "surfaces/map_state.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// State of a recording's pose alignment: part of the map's state, because it determines where the next scan
/// is inserted.
struct AlignmentState {
  /// A hypothesis about the drift rate of the given poses, with the drift and the sensor's systematic error
  /// estimated under it.
  struct Hypothesis {
    static constexpr int size = 6 + sensor_error_size;
    double rate_m = 0;   ///< standard deviation of the drift per metre of travel, m; 0: poses are exact
    bool level = false;  ///< drift only in yaw and translation, as of odometry with gravity
    Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();  ///< T_map_sensor = correction · given
    Eigen::Matrix<double, sensor_error_size, 1> errors = decltype(errors)::Zero();
    /// Of the correction as a twist about the last sensor's position, and of the sensor's error.
    Eigen::Matrix<double, size, size> covariance = decltype(covariance)::Zero();
    double log_evidence = 0;
  };
  SensorKind sensor = SensorKind::depth_camera;  ///< of the first scan, whose errors are estimated
  std::vector<Hypothesis> hypotheses;     ///< empty before the first scan; the first is that of no drift
  std::size_t believed = 0;               ///< index of the accepted hypothesis
  std::optional<Eigen::Isometry3d> last;  ///< given pose of the last scan
  /// Scans to be inserted until the given poses count as in the map's frame again, after a break between two.
  std::size_t unsettled = 0;
  double travelled_m = 0;  ///< travel so far; a rotation by 1 rad counts as a metre
  double view_m = 0;       ///< travel at the last update of the hypotheses
  /// Recent means, 0 before any: share of a scan's readings near known surfaces, and of these the explained
  /// share.
  double usual_known = 0, usual_share = 0;
  /// The last failed search for a scan's place: its shares, and the travel at that time.
  struct Search {
    double known = 0, share = 0, travelled_m = 0;
  };
  std::optional<Search> failed_search;
  double patch_m = 0;                     ///< scatter of revisited patches beyond their readings' noise
  std::optional<Eigen::Isometry3d> jump;  ///< correction of the last scan, if that one was far off
};

/// Alignment's state of a recording, stored by MapState.
struct AlignmentRecord {
  AlignmentState state;
  SeenPatches patches;
  void apply(AlignmentState after, const std::vector<SeenPatches::Change>& seen) {
    state = std::move(after);
    for (const auto& [key, patch] : seen) patches.set(key, patch);
  }
};
/// Made at the first call.
inline AlignmentRecord& record_of(surfaces::MapState& map) {
  if (!map.alignment) map.alignment = std::make_shared<AlignmentRecord>();
  return *map.alignment;
}
inline const AlignmentRecord& record_of(const surfaces::MapState& map) {
  static const AlignmentRecord none;
  return map.alignment ? *map.alignment : none;
}

}  // namespace octosurf::alignment
