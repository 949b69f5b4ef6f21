#include "alignment/drift_filter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace octosurf::alignment {
namespace {

/// Standard deviation per metre of travel in m, and a third as much in rad: visual or legged odometry drifts
/// a tenth of a per cent to a few per cent over ten metres. Steps of four, because a random walk's gain
/// follows the square root of its rate.
constexpr std::array<double, 3> rates_m{0.001, 0.004, 0.016};
constexpr double rate_lever_m = 3;
/// Maximum number of views used per span of travel.
constexpr double views_a_span = 10;
/// No pose is corrected by less than twice the map's own error.
constexpr double least_correction_voxels = 2 * map_error_voxels;
/// Log of the likelihood ratio required before drift is accepted: about one in a thousand recordings without
/// drift is accepted wrongly.
const double required = std::log(1000.0);
/// Log likelihood by which a hypothesis may fall behind the best, so that drift may begin or end at any time.
constexpr double most_behind = 10;
/// Degrees of freedom of the measurements' errors: few, for heavy tails.
constexpr double freedom = 4;

using Numbers = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
using State = Eigen::Matrix<double, AlignmentState::Hypothesis::size, 1>;

/// Made exactly symmetric, because a map file stores all entries.
template <class Matrix>
Matrix symmetric(const Matrix& P) {
  return 0.5 * (P + P.transpose());
}

double way_of(const Twist& motion) { return motion.head<3>().norm() + motion.tail<3>().norm(); }

/// Process noise per metre of travel.
TwistCovariance rates_of(const AlignmentState::Hypothesis& h, const Eigen::Vector3d& up) {
  const double rate_rad = h.rate_m / rate_lever_m;
  const Eigen::Matrix3d along = up * up.transpose(), all = Eigen::Matrix3d::Identity();
  TwistCovariance rates = TwistCovariance::Zero();
  rates.topLeftCorner<3, 3>() = rate_rad * rate_rad * (h.level ? along : all);
  rates.bottomRightCorner<3, 3>() = h.rate_m * h.rate_m * (h.level ? all - along : all);
  return rates;
}

}  // namespace

DriftFilter::DriftFilter(AlignmentState& state, SensorKind sensor, double resolution,
                         const Eigen::Vector3d& up)
    : state_(state), resolution_(resolution), up_(up) {
  if (!state.hypotheses.empty()) return;
  state.sensor = sensor;
  state.patch_m = map_error_voxels * resolution;
  AlignmentState::Hypothesis h;
  h.covariance.diagonal().tail<sensor_error_size>() = usual_errors(sensor).cwiseAbs2();
  state.hypotheses.push_back(h);
  for (const double rate : rates_m)
    for (const bool level : {true, false}) {
      h.rate_m = rate;
      h.level = level;
      state.hypotheses.push_back(h);
    }
}

void DriftFilter::advance(const Eigen::Isometry3d& T_given) {
  T_given_ = T_given;
  if (state_.last) {
    const Twist motion = twist_between(*state_.last, T_given);
    const double way = way_of(motion);
    state_.travelled_m += way;
    for (Hypothesis& h : state_.hypotheses) {
      if (h.rate_m == 0) continue;
      // The same motion about the sensor's next position: t' = t + ω × (next − last).
      const Eigen::Vector3d d = h.correction.linear() * motion.tail<3>();
      Eigen::Matrix3d turning;
      turning << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
      auto& P = h.covariance;
      P.middleRows<3>(3) += (turning * P.topRows<3>()).eval();
      P.middleCols<3>(3) += (P.leftCols<3>() * turning.transpose()).eval();
      P.topLeftCorner<6, 6>() += way * rates_of(h, up_);
      P = symmetric(P);
    }
  }
  state_.last = T_given;
}

bool DriftFilter::is_new_view() const {
  return state_.travelled_m == 0 || state_.travelled_m - state_.view_m >= revisit_span_m / views_a_span;
}

/// First the sensor's error from what no motion explains, then both from what a motion could.
void DriftFilter::learn(Hypothesis& h, const Eigen::Isometry3d& T_laid, const Revisit& revisit) const {
  // Common errors of views decorrelate over a span, so this many views count as one (autoregressive error).
  const double way = std::max(state_.travelled_m - state_.view_m, revisit_span_m / views_a_span);
  const double alike = 1 / std::tanh(way / (2 * revisit_span_m));
  const SensorErrorCovariance information = revisit.error_information / alike;
  const SensorErrors right = revisit.error_vector / alike;
  auto& P = h.covariance;
  State step = State::Zero();
  {
    const SensorErrorCovariance own = P.bottomRightCorner<sensor_error_size, sensor_error_size>();
    const SensorErrorCovariance widened = SensorErrorCovariance::Identity() + own * information;
    const SensorErrorCovariance share = information * widened.inverse();
    const Eigen::Matrix<double, State::RowsAtCompileTime, sensor_error_size> of_errors =
        P.rightCols<sensor_error_size>();
    P = symmetric((P - of_errors * share * of_errors.transpose()).eval());
    step = P.rightCols<sensor_error_size>() * (right - information * h.errors);
  }
  h.errors += step.tail<sensor_error_size>();
  if (h.rate_m > 0) h.correction = moved(h.correction * T_given_, step.head<6>()) * T_given_.inverse();
  if (revisit.motion.size() == 0) return;

  Eigen::Matrix<double, Eigen::Dynamic, State::RowsAtCompileTime, 0, 6, State::RowsAtCompileTime> H(
      revisit.motion.size(), int{State::RowsAtCompileTime});
  H << revisit.directions, revisit.by_error;
  const Eigen::Isometry3d T = h.correction * T_given_;
  const Numbers innovation =
      revisit.directions * twist_between(T, T_laid) + revisit.motion - revisit.by_error * h.errors;
  const double common = alike * revisit.scatter_m * revisit.scatter_m;
  const auto across = (P * H.transpose()).eval();
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6> S = H * across;
  S.diagonal().array() += revisit.variances.array() + common;
  const Eigen::LLT<decltype(S)> solver(S);
  const Numbers weighted = solver.solve(innovation);
  // Student's t: an unmodelled error, such as a wrong correspondence, weighs no more than a few scans.
  const double squared = innovation.dot(weighted), dimensions = static_cast<double>(innovation.size());
  h.log_evidence -= solver.matrixLLT().diagonal().array().log().sum() +
                    (freedom + dimensions) / 2 * std::log1p(squared / freedom);
  const double share = std::min(1.0, (freedom + dimensions) / (freedom + squared));
  step = share * across * weighted;
  P = symmetric((P - share * across * solver.solve(across.transpose())).eval());
  h.errors += step.tail<sensor_error_size>();
  if (h.rate_m > 0) h.correction = moved(T, step.head<6>()) * T_given_.inverse();
}

void DriftFilter::learn(const Eigen::Isometry3d& T_laid, const Revisit& revisit) {
  for (Hypothesis& h : state_.hypotheses) learn(h, T_laid, revisit);
  double most = state_.hypotheses.front().log_evidence;  // only their differences matter
  for (const Hypothesis& h : state_.hypotheses) most = std::max(most, h.log_evidence);
  for (Hypothesis& h : state_.hypotheses) h.log_evidence = std::max(h.log_evidence - most, -most_behind);
  choose();
}

void DriftFilter::choose() {
  const auto& all = state_.hypotheses;
  std::size_t drifting = 1;
  for (std::size_t i = 2; i < all.size(); ++i)
    if (all[i].log_evidence > all[drifting].log_evidence) drifting = i;
  const double better = all[drifting].log_evidence - all[0].log_evidence;
  const bool large = way_of(twist_between(T_given_, all[drifting].correction * T_given_)) >
                     least_correction_voxels * resolution_;
  const bool drifted = drifts() ? better > -required : better > required && large;
  state_.believed = drifted ? drifting : 0;
}

void DriftFilter::jump(const Eigen::Isometry3d& correction) {
  for (Hypothesis& h : state_.hypotheses) {
    if (h.rate_m == 0) {
      h.log_evidence = -most_behind;  // the given poses are not right
      continue;
    }
    h.correction = correction;
    h.covariance.topRows<6>().setZero();
    h.covariance.leftCols<6>().setZero();
    h.covariance.topLeftCorner<6, 6>() = rates_of(h, up_);
  }
  choose();
  if (!drifts()) state_.believed = 1;
}

}  // namespace octosurf::alignment
