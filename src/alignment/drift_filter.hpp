#pragma once

#include "alignment/revisit.hpp"
#include "surfaces/alignment_state.hpp"

#include <Eigen/Geometry>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// How far the given poses have drifted off the map, and what the sensor errs by itself.
///
/// The correction C (T_map_sensor = C · T_given) is a random walk over the way, the sensor's error (see
/// SensorErrors) is constant; both are measured where patches are seen again that were seen long ago. A
/// Kalman filter over both for each of a few rates of drift, of which one is none; the one that predicted the
/// measurements best is believed (multiple models, Magill 1965). A sensor's error thus competes with drift in
/// every filter: it explains what turns with the sensor and does not grow, drift what grows with the way and
/// stays in the map's frame.
///
/// No drift stays in force until another rate is better by more than chance explains: exact poses stay as
/// given, to the bit. Where nothing old is seen the correction stays as it was.
class DriftFilter {
 public:
  /// Goes on with what is known; `state` must outlive it.
  DriftFilter(surfaces::AlignmentState& state, SensorKind sensor, double resolution,
              const Eigen::Vector3d& up);

  /// The next scan, given at T_given: from here on all is about its place.
  void advance(const Eigen::Isometry3d& T_given);
  /// Its pose by what is believed.
  Eigen::Isometry3d pose() const { return believed().correction * T_given_; }
  /// Of the correction, a twist about the scan's sensor. Zero where no drift is believed in.
  TwistCovariance covariance() const { return believed().covariance.topLeftCorner<6, 6>(); }
  /// Whether the scan is far enough from the last one that was learned from to tell something else.
  bool is_new_view() const;
  /// Updates all filters by the scan, laid on the map at `T_laid`.
  void learn(const Eigen::Isometry3d& T_laid, const Revisit& revisit);
  /// The poses have jumped, and the map fits with this correction.
  void jump(const Eigen::Isometry3d& correction);

  bool drifts() const { return believed().rate_m > 0; }
  const SensorErrors& sensor_errors() const { return believed().errors; }

 private:
  using Hypothesis = surfaces::AlignmentState::Hypothesis;
  const Hypothesis& believed() const { return state_.hypotheses[state_.believed]; }
  void learn(Hypothesis& h, const Eigen::Isometry3d& T_laid, const Revisit& revisit) const;
  void choose();

  surfaces::AlignmentState& state_;
  double resolution_;
  Eigen::Vector3d up_;
  Eigen::Isometry3d T_given_ = Eigen::Isometry3d::Identity();
};

}  // namespace octosurf::alignment
