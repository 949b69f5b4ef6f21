#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <optional>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// What a sensor errs by throughout a recording, beyond what noise and drift explain: it is mounted otherwise
/// than the poses say, or its readings are too long by a factor.
struct SensorBias {
  Eigen::Vector3d tilt_rad = Eigen::Vector3d::Zero();    ///< T_map_sensor = given · rotation, sensor's axes
  double range_scale = 0;                                ///< readings are longer by this share: 0.01 is 1 %
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of tilt and scale
};

/// Gathers it from what alignment says of each scan. It is told, never applied: which of calibration,
/// mounting and poses is wrong, only the robot's owner knows.
///
/// What is in the map was put there with the bias in it: a scan agrees with it where its pose is corrected by
/// the map's own error there (c, a rotation, and τ, a translation, both of which drift), and by what the bias
/// makes of that: a sensor that is tilted by ω wants R·ω more, which turns with it, and one whose readings
/// are too long by κ finds that it has moved by κ times more than its poses say. Whatever a scan adds has the
/// error of its own pose, as that was used. A Kalman filter over (c, τ, ω, κ), one for each of a few rates of
/// drift, of which the likeliest counts. What the recording does not tell (a tilt about an axis about which
/// the sensor never turned) keeps the variance that it was assumed to have.
///
/// A lower bound rather than a measurement: where poses are corrected late or not at all, the map takes up
/// part of the bias, and `covariance` does not know it. On simulated scenes tilts came out at 53 to 92 % of
/// what they were, scales at 93 and 102 % on stairs, at 13 and 50 % in an office. A map that alignment has
/// bent tells false ones.
class SensorBiasEstimator {
 public:
  /// One scan after the other, of which `new_share` is new in the map; O(1).
  void add(const Eigen::Isometry3d& T_given, const Alignment& alignment, double new_share);
  /// None before some views have been seen.
  std::optional<SensorBias> estimate() const;
  /// Scans of which each shows something else than the one before.
  std::size_t views() const { return views_; }

 private:
  static constexpr int size = 10;
  using State = Eigen::Matrix<double, size, 1>;
  using StateCovariance = Eigen::Matrix<double, size, size>;
  struct Filter {
    double rate_rad = 0;  ///< what a view adds to c, and by the lever to τ
    State state = State::Zero();
    StateCovariance covariance = StateCovariance::Zero();
    double log_determinants = 0, squares = 0;  ///< of the innovations' covariances; of innovations by these
    /// With the measurements' own scale at its likeliest.
    double log_evidence(double numbers) const;
  };
  bool shows_else(const Eigen::Isometry3d& T_given, double lever_m) const;
  void begin();
  void predict(Filter& filter, const Eigen::Isometry3d& T_given, double lever_m) const;
  static void update(Filter& filter, const Eigen::Isometry3d& T_given, const Alignment& alignment);

  std::array<Filter, 5> filters_{};
  struct View {
    Eigen::Isometry3d T_given = Eigen::Isometry3d::Identity();
    Twist correction = Twist::Zero();  ///< with which it was used
  };
  std::optional<View> last_;
  double known_ = 1;  ///< share of what the next view may show that was there before the last one
  std::size_t views_ = 0;
  double numbers_ = 0;  ///< measured so far
};

}  // namespace octosurf::alignment
