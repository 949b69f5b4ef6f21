#pragma once

#include "surfaces/alignment_state.hpp"

#include <Eigen/Geometry>
#include <functional>

namespace octosurf::alignment {

/// A scan's pose as its readings tell it: the determined directions alone.
struct PoseMeasurement {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6> directions;  ///< rows: what is measured of a twist
  Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> motions;     ///< columns: the twists that these stand for
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> variances;   ///< of each, independent
  double lever_m = 1;                                            ///< at which a rotation counts
  double least_m = 0;  ///< corrections that are smaller may be the map's and the sensor's own errors
  /// Whether more readings lie on surfaces at this pose than at the given one: called only where all else
  /// speaks for drift that was not believed in before.
  std::function<bool()> contradicts_given = [] { return true; };
};

/// How far the given poses have slid off the map, followed from scan to scan.
///
/// The correction C (T_map_sensor = C · T_given) is constant but for what each scan adds: a random walk, or,
/// of a frame that creeps and of an odometry that is biased, nearly the same from scan to scan (a
/// Gauss–Markov process of first order). A measurement of it errs in two ways: by the readings' noise, and by
/// what it has in common with its neighbours, which see the same errors of the map; the latter fades as other
/// surfaces come into view. How fast the poses drift, and how far the measurements' own covariances can be
/// trusted, is learned: a bank of Kalman filters runs side by side, one for each kind and rate of drift and
/// each factor on the covariances, and the one that predicted the measurements best so far is believed
/// (multiple models, Magill 1965). Among them is the one without drift. It stays in force until another is
/// better by more than chance explains, so that exact poses stay exactly as given. A hypothesis that has
/// fallen as far behind as any may is one of a drift that begins now (see most_behind): it starts again from
/// the best one. Where nothing measures, one that had gone on by itself might have taken the poses anywhere,
/// and the first measurements that err alike would be believed to have shown where.
class DriftFilter {
 public:
  /// Goes on with what is known; `state` must outlive it. A drift that nobody noticed so far has taken the
  /// poses no farther than `unnoticed_m`.
  DriftFilter(surfaces::AlignmentState& state, double unnoticed_m);

  /// The next scan's pose as expected, and its covariance, before it is looked at. Zero where no drift is
  /// known of.
  Eigen::Isometry3d expected(const Eigen::Isometry3d& T_given) const;
  TwistCovariance expected_covariance(const Eigen::Isometry3d& T_given) const;

  /// Whether a measurement of the next scan lies where drift and the measurements' errors, as believed, may
  /// have put it. What does not has jumped.
  bool may_lie(const Eigen::Isometry3d& T_given, const PoseMeasurement& measurement) const;

  /// The next scan's measurement; none tells nothing but that time has passed. Returns the pose to use. About
  /// 0.5 ms.
  Eigen::Isometry3d update(const Eigen::Isometry3d& T_given, const PoseMeasurement* measurement);
  /// The poses have jumped: this is their correction from now on, whatever was believed before.
  void jump(const Eigen::Isometry3d& correction);

  /// There is drift, by the evidence so far.
  bool drifts() const { return believed().rate_m > 0; }
  /// Factor on the standard deviations of measurements: as believed.
  double factor() const { return believed().factor; }

 private:
  using Hypothesis = surfaces::AlignmentState::Hypothesis;
  const Hypothesis& believed() const { return state_.hypotheses[state_.believed]; }
  bool noticed(const Hypothesis& h) const;
  void predict(Hypothesis& h, const Eigen::Isometry3d& T_given) const;
  template <int size>
  struct Prediction;
  template <int size>
  static void learn(Hypothesis& h, const Eigen::Isometry3d& T_given, const PoseMeasurement& measurement);
  void choose(const Eigen::Isometry3d& T_given, const PoseMeasurement& measurement);
  std::size_t most_likely(bool drifting) const;

  surfaces::AlignmentState& state_;
  double unnoticed_m_;
};

}  // namespace octosurf::alignment
