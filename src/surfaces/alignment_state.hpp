#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::surfaces {

/// What is known of a recording's poses so far (src/alignment, which alone reads and writes it): a part of
/// the map's state, because it decides where the next scan is inserted.
struct AlignmentState {
  /// How what one scan adds to the poses' drift hangs together with what the next one adds.
  enum class Drift {
    walk,      ///< not at all
    of_frame,  ///< nearly the same motion a metre of the way, about a place of the map: the frame that the
               ///< poses are given in creeps
    of_sensor  ///< nearly the same motion in the sensor's own axes: the odometry is biased
  };
  /// One of the ways in which the given poses may drift, and how far they have gone if it is true.
  struct Hypothesis {
    /// Of `correction` about the last sensor's position, of `common` and, of a steady drift, of `velocity`.
    using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 18, 18>;

    Drift drift = Drift::walk;
    /// Standard deviation that a scan adds to a walk, and of a steady drift for each metre of the way; none:
    /// the poses are right as given.
    double rate_m = 0, rate_rad = 0;
    double factor = 1;        ///< on the measurements' standard deviations
    double common_share = 0;  ///< variance of what measurements have in common, as a share of their own …
    double lasting = 0;       ///< … and the share of it that is left at the next scan
    Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();  ///< T_map_sensor = correction · given
    Twist common = Twist::Zero();    ///< what neighbouring measurements have in common now
    Twist velocity = Twist::Zero();  ///< of a steady drift: what a metre of the way adds to the correction
    Covariance covariance = Covariance::Zero(12, 12);
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

  std::vector<Hypothesis> hypotheses;     ///< none before the first scan
  std::size_t believed = 0;               ///< which of them
  std::optional<Eigen::Isometry3d> last;  ///< the pose with which the last scan was inserted
  /// Shares lately, 0 before any: of a scan's readings those near known surfaces, and of these those
  /// explained.
  double usual_known = 0, usual_share = 0;
  /// How much larger than the noise model says a reading's variance is, and what readings of a surface have
  /// in common, as a share of that: as the residuals tell.
  double noise_factor2 = 1, common_share = 0.5;
  std::uint32_t scans_learned = 0;        ///< those that told of these errors
  std::optional<Eigen::Isometry3d> jump;  ///< correction of the last scan, if that one was recovered
};

}  // namespace octosurf::surfaces
