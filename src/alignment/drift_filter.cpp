#include "alignment/drift_filter.hpp"

#include "alignment/pose_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <optional>

namespace octosurf::alignment {
namespace {

// Grids by factors of about three: a random walk's gain follows the square root of its rate, so that the next
// best rate is never far from the best one. Rates of both kinds go together, up to a factor of three.
constexpr std::array<double, 7> rates_m{0.00001, 0.00003, 0.0001, 0.0003, 0.001, 0.003, 0.01};
constexpr std::array<double, 7> rates_rad{0.000003, 0.00001, 0.00003, 0.0001, 0.0003, 0.001, 0.003};
constexpr std::array<double, 3> factors{0.5, 1, 3};
struct CommonErrors {
  double share, lasting;
};
/// What neighbouring measurements have in common, in the sensor's axes: its variance as a share of the
/// readings' own, and the share of it that is left at the next scan. The map's errors: on simulated scenes
/// with exact poses measurements correlate by 0.1 to 0.5 from scan to scan and by 0.1 over eight, because
/// other surfaces come into view. The sensor's own errors (a depth camera's bias over its picture, a focal
/// length that is off) are larger than what the residuals show, since a pose takes up most of them, and stay:
/// they turn with the sensor, which is what tells them from drift. How much larger differs from sensor to
/// sensor: a grid by factors of eight, up to six times as large.
constexpr std::array<CommonErrors, 3> common_errors{{{0.5, 0.85}, {4, 0.98}, {32, 0.98}}};
/// Natural logarithm of how likely it is that a recording goes on as it did: at every scan it may begin to
/// drift otherwise, such as where a loop closes on what was mapped first, with a chance of about one in
/// 20,000 for each of the hypotheses. None of them falls further behind the best.
constexpr double most_behind = 10;
/// Degrees of freedom of the measurements' errors: few, they are heavy-tailed.
constexpr double freedom = 4;
/// Natural logarithm by which drift must be the better explanation before it is believed: of a thousand
/// recordings without drift, about one is taken for one with.
const double required = std::log(1000.0);
/// By which a correction must differ from none, as usual; that it is there at all is for the evidence of many
/// scans to tell.
constexpr double certainty = 0.95;

using Drift = surfaces::AlignmentState::Drift;
using Hypothesis = surfaces::AlignmentState::Hypothesis;
template <int size>
using Joint = Eigen::Matrix<double, size, size>;

/// To the last bit: a map file keeps one half.
template <int size>
Joint<size> symmetric(const Joint<size>& P) {
  return 0.5 * (P + P.transpose());
}

/// Share of what a scan added that the next one adds again, of a steady drift: it lasts for some thousand
/// scans, half a minute of a camera. A drift of v a scan takes (noise / v)^⅔ scans to be told from the noise,
/// ten where v is a thirtieth of that, and must last for many times as long to be worth knowing. One that
/// lasts for N scans is followed with a lag of noise · v / (rate · √(2 N)), for its velocity is always pulled
/// back to none.
constexpr double steadiness = 0.999;
struct SteadyRate {
  double m, rad;
};
/// Grid of rates of steady drift, for each metre of the way, by factors of ten: a rate only says how large a
/// velocity may be before it is known. The largest is a hundredth of the way and 0.2° a metre, about what a
/// walking robot's odometry errs by. Of the way and not of a scan, which a camera takes every centimetre and
/// a survey every metre: where measurements err alike for ten scans, a larger one would follow them, and go
/// on along directions that nothing measures.
constexpr std::array<SteadyRate, 3> steady_rates{{{0.0001, 0.00003}, {0.001, 0.0003}, {0.01, 0.003}}};

/// Length of a motion, m: rotations count at a metre, where most of what a robot sees is.
double way_of(const Twist& motion) { return motion.head<3>().norm() + motion.tail<3>().norm(); }

/// Variances of what a scan adds, or a metre of the way.
Twist rates_of(const Hypothesis& h) {
  Twist rates;
  rates << Eigen::Vector3d::Constant(h.rate_rad * h.rate_rad), Eigen::Vector3d::Constant(h.rate_m * h.rate_m);
  return rates;
}

/// Nothing is known but how fast it may drift.
void begin(Hypothesis& h) {
  h.common.setZero();
  h.velocity.setZero();
  h.covariance.setZero(h.drift == Drift::walk ? 12 : 18, h.drift == Drift::walk ? 12 : 18);
  if (h.drift != Drift::walk) h.covariance.bottomRightCorner<6, 6>() = rates_of(h).asDiagonal();
}

/// A drift that begins now begins where the poses are by the best explanation so far.
void begin_from(const Hypothesis& best, Hypothesis& h) {
  begin(h);
  h.common = best.common;
  if (h.rate_m > 0) {
    h.correction = best.correction;
    h.covariance.topLeftCorner<12, 12>() = best.covariance.topLeftCorner<12, 12>();
  } else {
    h.covariance.block<6, 6>(6, 6) = best.covariance.block<6, 6>(6, 6);
  }
}

/// Whether a motion is more than one measurement may be off. However many scans repeat a measurement, what
/// they have in common does not average out: the errors of the planes that they all see. By what factor their
/// readings err otherwise than they were held to makes the planes neither better nor worse.
bool significant(const Twist& motion, const PoseMeasurement& measurement) {
  const auto along = (measurement.directions * motion).eval();
  const double squared = (along.array().square() / measurement.variances.array()).sum();
  const boost::math::chi_squared by_chance(static_cast<double>(std::max<Eigen::Index>(1, along.size())));
  return squared > boost::math::quantile(by_chance, certainty);
}

}  // namespace

DriftFilter::DriftFilter(surfaces::AlignmentState& state, double unnoticed_m)
    : state_(state), unnoticed_m_(unnoticed_m) {
  if (!state.hypotheses.empty()) return;
  const auto add = [&](Drift drift, double rate_m, double rate_rad) {
    for (const CommonErrors& common : common_errors)
      for (const double factor : factors) {
        Hypothesis h;
        h.drift = drift;
        h.rate_m = rate_m;
        h.rate_rad = rate_rad;
        h.factor = factor;
        h.common_share = common.share;
        h.lasting = common.lasting;
        begin(h);
        state.hypotheses.push_back(h);
      }
  };
  add(Drift::walk, 0, 0);
  for (std::size_t m = 0; m < rates_m.size(); ++m)
    for (std::size_t r = m > 0 ? m - 1 : 0; r <= m + 1 && r < rates_rad.size(); ++r)
      add(Drift::walk, rates_m[m], rates_rad[r]);
  for (const SteadyRate& rate : steady_rates) {
    add(Drift::of_frame, rate.m, rate.rad);
    add(Drift::of_sensor, rate.m, rate.rad);
  }
}

/// Whether it would have been noticed, had the poses drifted so all the time: rotations count at a metre.
bool DriftFilter::noticed(const Hypothesis& h) const {
  return h.covariance.diagonal().head<6>().maxCoeff() > unnoticed_m_ * unnoticed_m_;
}

void DriftFilter::predict(Hypothesis& h, const Eigen::Isometry3d& T_given) const {
  if (!state_.last) return;
  const Eigen::Isometry3d T = h.correction * T_given;
  // What is in the sensor's axes turns with it.
  const Eigen::Matrix3d R = T.linear() * state_.last->linear().transpose();
  TwistCovariance turn = TwistCovariance::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R;
  h.common = h.lasting * turn * h.common;
  // The same motion about the sensor's next position: t' = t + ω × (next − last).
  const Eigen::Vector3d d = T.translation() - state_.last->translation();
  TwistCovariance moving = TwistCovariance::Identity();
  moving.bottomLeftCorner<3, 3>() << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
  const Twist rates = rates_of(h);
  if (h.drift == Drift::walk) {
    Joint<12> P = h.covariance;
    P.topRows<6>() = (moving * P.topRows<6>()).eval();
    P.bottomRows<6>() = (h.lasting * turn * P.bottomRows<6>()).eval();
    P.leftCols<6>() = (P.leftCols<6>() * moving.transpose()).eval();
    P.rightCols<6>() = (P.rightCols<6>() * (h.lasting * turn).transpose()).eval();
    P.diagonal().head<6>() += rates;
    h.covariance = symmetric(P);
    return;
  }
  const TwistCovariance again = steadiness * (h.drift == Drift::of_frame ? moving : turn);
  const double way = way_of(twist_between(*state_.last, T));
  h.velocity = again * h.velocity;
  h.correction = moved(T, way * h.velocity) * T_given.inverse();
  Joint<18> P = h.covariance;
  const auto forward = [&](auto correction, auto common, auto velocity) {
    velocity = (again * velocity).eval();
    correction = (moving * correction + way * velocity).eval();
    common = (h.lasting * turn * common).eval();
  };
  forward(P.topRows<6>(), P.middleRows<6>(6), P.bottomRows<6>());
  P.transposeInPlace();
  forward(P.topRows<6>(), P.middleRows<6>(6), P.bottomRows<6>());
  const Twist news = (1 - steadiness * steadiness) * rates;
  P.diagonal().head<6>() += way * way * news;
  P.diagonal().tail<6>() += news;
  P.topRightCorner<6, 6>().diagonal() += way * news;
  P.bottomLeftCorner<6, 6>().diagonal() += way * news;
  h.covariance = symmetric(P);
}

Eigen::Isometry3d DriftFilter::expected(const Eigen::Isometry3d& T_given) const {
  if (!drifts()) return T_given;
  Hypothesis h = believed();
  predict(h, T_given);
  return h.correction * T_given;
}

TwistCovariance DriftFilter::expected_covariance(const Eigen::Isometry3d& T_given) const {
  Hypothesis h = believed();
  predict(h, T_given);
  return h.covariance.topLeftCorner<6, 6>();
}

/// A measurement beside what a hypothesis, already predicted for its scan, expects of it.
template <int size>
struct DriftFilter::Prediction {
  using Numbers = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

  Prediction(const Hypothesis& h, const Eigen::Isometry3d& T, const PoseMeasurement& measurement)
      : P(h.covariance) {
    const auto& M = measurement.directions;
    const Numbers noise = h.factor * h.factor * measurement.variances;
    P.template block<6, 6>(6, 6) += h.common_share * (1 - h.lasting * h.lasting) * measurement.motions *
                                    noise.asDiagonal() * measurement.motions.transpose();
    of_state = (P.template leftCols<6>() + P.template middleCols<6>(6)) * M.transpose();
    Square S = M * (of_state.template topRows<6>() + of_state.template middleRows<6>(6));
    S.diagonal() += noise;
    solver.compute(S);
    const Numbers innovation = M * (twist_between(T, measurement.T_map_sensor) - h.common);
    weighted = solver.solve(innovation);
    squared = innovation.dot(weighted);
  }
  double dimensions() const { return static_cast<double>(weighted.size()); }

  Joint<size> P;  ///< with what this scan adds to common errors
  Eigen::Matrix<double, size, Eigen::Dynamic, 0, size, 6> of_state;  ///< its covariance with the measurement
  Eigen::LLT<Square> solver;                                         ///< the innovation's covariance
  Numbers weighted;                                                  ///< the innovation by its covariance …
  double squared = 0;                                                ///< … and its square by it
};

/// What a measurement tells a hypothesis.
template <int size>
void DriftFilter::learn(Hypothesis& h, const Eigen::Isometry3d& T_given, const PoseMeasurement& measurement) {
  const Eigen::Isometry3d T = h.correction * T_given;
  const Prediction<size> predicted(h, T, measurement);
  // Student's t: of errors that no model has, such as a wrong pairing, one scan tells no more than a few
  // do.
  const double squared = predicted.squared, dimensions = predicted.dimensions();
  h.log_evidence -= predicted.solver.matrixLLT().diagonal().array().log().sum() +
                    (freedom + dimensions) / 2 * std::log1p(squared / freedom);
  const double share = std::min(1.0, (freedom + dimensions) / (freedom + squared));
  const Eigen::Matrix<double, size, 1> step = share * predicted.of_state * predicted.weighted;
  h.covariance = symmetric<size>(predicted.P - share * predicted.of_state *
                                                   predicted.solver.solve(predicted.of_state.transpose()));
  h.common += step.template segment<6>(6);
  if constexpr (size == 18) h.velocity += step.template tail<6>();
  if (h.rate_m > 0) h.correction = moved(T, step.template head<6>()) * T_given.inverse();
}

/// Of Student's t in so many dimensions, the square over its dimensions is distributed as Fisher's F.
bool DriftFilter::may_lie(const Eigen::Isometry3d& T_given, const PoseMeasurement& measurement) const {
  if (measurement.variances.size() == 0) return true;
  Hypothesis h = believed();
  predict(h, T_given);
  const Eigen::Isometry3d T = h.correction * T_given;
  const double squared = h.drift == Drift::walk ? Prediction<12>(h, T, measurement).squared
                                                : Prediction<18>(h, T, measurement).squared;
  const auto dimensions = static_cast<double>(measurement.variances.size());
  const boost::math::fisher_f by_error(dimensions, freedom);
  return squared <
         dimensions * boost::math::quantile(boost::math::complement(by_error, std::exp(-most_behind)));
}

Eigen::Isometry3d DriftFilter::update(const Eigen::Isometry3d& T_given, const PoseMeasurement* measurement) {
  for (Hypothesis& h : state_.hypotheses) {
    predict(h, T_given);
    if (measurement == nullptr) continue;
    if (h.drift == Drift::walk)
      learn<12>(h, T_given, *measurement);
    else
      learn<18>(h, T_given, *measurement);
  }
  const auto best =
      std::max_element(state_.hypotheses.begin(), state_.hypotheses.end(),
                       [](const auto& a, const auto& b) { return a.log_evidence < b.log_evidence; });
  const double most = best->log_evidence;  // their differences count
  for (Hypothesis& h : state_.hypotheses) {
    h.log_evidence -= most;
    if (h.log_evidence > -most_behind) continue;
    h.log_evidence = -most_behind;
    if (noticed(h)) begin_from(*best, h);
  }
  if (measurement != nullptr) choose(T_given, *measurement);
  const Eigen::Isometry3d T = drifts() ? believed().correction * T_given : T_given;
  state_.last = T;
  return T;
}

void DriftFilter::jump(const Eigen::Isometry3d& correction) {
  for (Hypothesis& h : state_.hypotheses) {
    begin(h);
    if (h.rate_m == 0) {
      h.log_evidence = -most_behind;  // the poses are not right as given
      continue;
    }
    h.correction = correction;
    h.covariance.topLeftCorner<6, 6>() = rates_of(h).asDiagonal();
  }
  state_.believed = most_likely(true);
}

std::size_t DriftFilter::most_likely(bool drifting) const {
  const std::vector<Hypothesis>& all = state_.hypotheses;
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < all.size(); ++i)
    if ((all[i].rate_m > 0) == drifting && (!best || all[i].log_evidence > all[*best].log_evidence)) best = i;
  return *best;
}

void DriftFilter::choose(const Eigen::Isometry3d& T_given, const PoseMeasurement& measurement) {
  const std::size_t still = most_likely(false), drifting = most_likely(true);
  const Hypothesis& h = state_.hypotheses[drifting];
  const double better = h.log_evidence - state_.hypotheses[still].log_evidence;
  const Twist correction = twist_between(T_given, h.correction * T_given);
  const double length = correction.tail<3>().norm() + measurement.lever_m * correction.head<3>().norm();
  const bool drifted = drifts() ? better > -required
                                : better > required && length > measurement.least_m &&
                                      significant(correction, measurement) && measurement.contradicts_given();
  state_.believed = drifted ? drifting : still;
}

}  // namespace octosurf::alignment
