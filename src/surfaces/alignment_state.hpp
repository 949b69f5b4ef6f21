#pragma once

#include "surfaces/seen_patches.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/scan.hpp>

namespace octosurf::surfaces {

/// What is known of a recording's poses so far (src/alignment, which alone reads and writes it): a part of
/// the map's state, because it decides where the next scan is inserted.
struct AlignmentState {
  /// One rate at which the given poses may drift, how far they have drifted if it is true, and the sensor's
  /// own error then.
  struct Hypothesis {
    static constexpr int size = 6 + sensor_error_size;
    double rate_m = 0;   ///< that a metre of the way adds, standard deviation, m; 0: the poses are right
    bool level = false;  ///< drifts about and across the vertical alone, as odometry that knows gravity does
    Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();  ///< T_map_sensor = correction · given
    Eigen::Matrix<double, sensor_error_size, 1> errors = decltype(errors)::Zero();
    /// Of the correction as a twist about the last sensor's position, and of the errors.
    Eigen::Matrix<double, size, size> covariance = decltype(covariance)::Zero();
    double log_evidence = 0;
  };
  /// A scan whose pose did not fit the map: what it may have seen is within `reach_m` of it.
  struct Misfit {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    double reach_m = 0;
    bool left_out = false;  ///< not in the map; else it was mapped as given
  };
  std::vector<Misfit> misfits;  ///< the last of them, at most most_misfits
  static constexpr std::size_t most_misfits = 256;
  void note_misfit(const Misfit& misfit) {
    if (misfits.size() == most_misfits) misfits.erase(misfits.begin());
    misfits.push_back(misfit);
  }

  SensorKind sensor = SensorKind::depth_camera;  ///< of the first scan: the errors are that one's
  std::vector<Hypothesis> hypotheses;     ///< none before the first scan; the first is that of no drift
  std::size_t believed = 0;               ///< which of them
  std::optional<Eigen::Isometry3d> last;  ///< the pose that the last scan was given with
  double way_m = 0;                       ///< so far; a rotation by 1 rad counts as a metre
  double view_m = 0;                      ///< where on the way the hypotheses were last updated
  /// Shares lately, 0 before any: of a scan's readings those near known surfaces, and of these those
  /// explained.
  double usual_known = 0, usual_share = 0;
  /// The last scan that was looked for elsewhere in vain: its shares, and where on the way it was.
  struct Search {
    double known = 0, share = 0, way_m = 0;
  };
  std::optional<Search> vain;
  double patch_m = 0;  ///< what patches seen again scatter by, beyond their readings' noise
  std::optional<Eigen::Isometry3d> jump;  ///< correction of the last scan, if that one lay far off
};

}  // namespace octosurf::surfaces
