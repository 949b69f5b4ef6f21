#include "alignment/drift_filter.hpp"

#include "alignment/pose_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
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
/// other surfaces come into view. The sensor's own errors (a depth camera's bias over its picture) are larger
/// than what the residuals show, since a pose takes up most of them, and stay: they turn with the sensor,
/// which is what tells them from drift.
constexpr std::array<CommonErrors, 2> common_errors{{{0.5, 0.85}, {4, 0.98}}};
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

DriftFilter::DriftFilter(surfaces::AlignmentState& state) : state_(state) {
  if (!state.hypotheses.empty()) return;
  const auto add = [&](double rate_m, double rate_rad) {
    for (const CommonErrors& common : common_errors)
      for (const double factor : factors) {
        Hypothesis h;
        h.rate_m = rate_m;
        h.rate_rad = rate_rad;
        h.factor = factor;
        h.common_share = common.share;
        h.lasting = common.lasting;
        state.hypotheses.push_back(h);
      }
  };
  add(0, 0);
  for (std::size_t m = 0; m < rates_m.size(); ++m)
    for (std::size_t r = m > 0 ? m - 1 : 0; r <= m + 1 && r < rates_rad.size(); ++r)
      add(rates_m[m], rates_rad[r]);
}

void DriftFilter::predict(Hypothesis& h, const Eigen::Isometry3d& T_map_sensor) const {
  if (!state_.last) return;
  // What is in the sensor's axes turns with it.
  const Eigen::Matrix3d R = T_map_sensor.linear() * state_.last->linear().transpose();
  TwistCovariance turn = TwistCovariance::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = h.lasting * R;
  h.common = turn * h.common;
  h.of_common = turn * h.of_common * turn.transpose();
  if (h.rate_m == 0) return;
  // The same motion about the sensor's next position: t' = t + ω × (next − last).
  const Eigen::Vector3d d = T_map_sensor.translation() - state_.last->translation();
  TwistCovariance moved = TwistCovariance::Identity();
  moved.bottomLeftCorner<3, 3>() << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
  h.between = moved * h.between * turn.transpose();
  h.covariance = moved * h.covariance * moved.transpose();
  h.covariance.diagonal().head<3>().array() += h.rate_rad * h.rate_rad;
  h.covariance.diagonal().tail<3>().array() += h.rate_m * h.rate_m;
}

Eigen::Isometry3d DriftFilter::expected(const Eigen::Isometry3d& T_given) const {
  return drifts() ? believed().correction * T_given : T_given;
}

TwistCovariance DriftFilter::expected_covariance(const Eigen::Isometry3d& T_given) const {
  Hypothesis h = believed();
  predict(h, expected(T_given));
  return h.covariance;
}

Eigen::Isometry3d DriftFilter::update(const Eigen::Isometry3d& T_given, const PoseMeasurement* measurement) {
  for (Hypothesis& h : state_.hypotheses) {
    const Eigen::Isometry3d T = h.correction * T_given;
    predict(h, T);
    if (measurement == nullptr) continue;
    const auto& M = measurement->directions;
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> noise =
        h.factor * h.factor * measurement->variances;
    h.of_common += h.common_share * (1 - h.lasting * h.lasting) * measurement->motions * noise.asDiagonal() *
                   measurement->motions.transpose();
    const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> of_correction =
        (h.covariance + h.between) * M.transpose();
    const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> of_common =
        (h.between.transpose() + h.of_common) * M.transpose();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6> S = M * (of_correction + of_common);
    S.diagonal() += noise;
    const Eigen::LLT<decltype(S)> solver(S);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> innovation =
        M * (twist_between(T, measurement->T_map_sensor) - h.common);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> weighted = solver.solve(innovation);
    // Student's t: of errors that no model has, such as a wrong pairing, one scan tells no more than a few
    // do.
    const double squared = innovation.dot(weighted);
    const auto dimensions = static_cast<double>(innovation.size());
    h.log_evidence -= solver.matrixLLT().diagonal().array().log().sum() +
                      (freedom + dimensions) / 2 * std::log1p(squared / freedom);
    const double share = std::min(1.0, (freedom + dimensions) / (freedom + squared));
    h.common += share * of_common * weighted;
    h.of_common -= share * of_common * solver.solve(of_common.transpose());
    if (h.rate_m == 0) continue;
    h.correction = moved(T, share * of_correction * weighted) * T_given.inverse();
    h.between -= share * of_correction * solver.solve(of_common.transpose());
    const TwistCovariance after =
        h.covariance - share * of_correction * solver.solve(of_correction.transpose());
    h.covariance = 0.5 * (after + after.transpose());
  }
  const auto best =
      std::max_element(state_.hypotheses.begin(), state_.hypotheses.end(),
                       [](const auto& a, const auto& b) { return a.log_evidence < b.log_evidence; });
  const double most = best->log_evidence;  // their differences count
  for (Hypothesis& h : state_.hypotheses) h.log_evidence = std::max(h.log_evidence - most, -most_behind);
  if (measurement != nullptr) choose(T_given, *measurement);
  const Eigen::Isometry3d T = expected(T_given);
  state_.last = T;
  return T;
}

void DriftFilter::jump(const Eigen::Isometry3d& correction) {
  for (Hypothesis& h : state_.hypotheses) {
    h.common.setZero();
    h.between.setZero();
    h.of_common.setZero();
    if (h.rate_m == 0) {
      h.log_evidence = -most_behind;  // the poses are not right as given
      continue;
    }
    h.correction = correction;
    h.covariance.setZero();
    h.covariance.diagonal().head<3>().setConstant(h.rate_rad * h.rate_rad);
    h.covariance.diagonal().tail<3>().setConstant(h.rate_m * h.rate_m);
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
  const bool drifted =
      drifts() ? better > -required
               : better > required && length > measurement.least_m && significant(correction, measurement);
  state_.believed = drifted ? drifting : still;
}

}  // namespace octosurf::alignment
