#include "alignment/sensor_bias.hpp"

#include "alignment/pose_fit.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::alignment {
namespace {

/// A scan is a view of its own if a quarter of what it shows is new, so that its surfaces' errors are not
/// those of the view before: turned by so much (rad: a quarter of a depth camera's field), or moved by this
/// share of its distance from what it sees.
constexpr double new_share = 0.25;
/// Standard deviations before anything is known: rad and m, as far as alignment looks, and a share.
constexpr double reach_rad = 0.0873, reach_m = 0.3, reach_share = 0.1;
/// In steps of ten, because a random walk's gain follows the root of its rate.
constexpr std::array<double, 5> rates_rad{0, 1e-6, 1e-5, 1e-4, 1e-3};
/// Measured numbers for each that is fitted: their scatter is then known to a quarter.
constexpr double numbers_each = 8;

Eigen::Vector3d squared(double value) { return Eigen::Vector3d::Constant(value * value); }

Eigen::Matrix3d cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

void SensorBiasEstimator::begin() {
  for (std::size_t i = 0; i < filters_.size(); ++i) {
    filters_[i].rate_rad = rates_rad[i];
    filters_[i].covariance.diagonal() << squared(reach_rad), squared(reach_m), squared(reach_rad),
        reach_share * reach_share;
  }
}

bool SensorBiasEstimator::shows_else(const Eigen::Isometry3d& T_given, double lever_m) const {
  const Twist twist = twist_between(last_->T_given, T_given);
  return twist.head<3>().norm() > new_share || twist.tail<3>().norm() > new_share * lever_m;
}

void SensorBiasEstimator::add(const Eigen::Isometry3d& T_given, const Alignment& alignment,
                              double new_share) {
  const AlignmentOutcome outcome = alignment.outcome;
  if (outcome == AlignmentOutcome::recovered && last_)  // the poses jumped
    for (Filter& filter : filters_)
      filter.covariance.diagonal().head<6>() += (Twist() << squared(reach_rad), squared(reach_m)).finished();
  if (outcome != AlignmentOutcome::agrees && outcome != AlignmentOutcome::corrected) return;
  if (last_) known_ *= 1 - new_share;
  if (alignment.determined == 0 || (last_ && !shows_else(T_given, alignment.lever_m))) return;
  if (!last_) begin();
  for (Filter& filter : filters_) {
    if (last_) predict(filter, T_given, alignment.lever_m);
    update(filter, T_given, alignment);
  }
  numbers_ += alignment.determined;
  last_ = View{T_given, twist_between(T_given, alignment.T_map_sensor)};
  known_ = 1 - new_share;
  ++views_;
}

/// What the last view added to the map has that view's error; then the map's motion about the sensor's next
/// position, and what readings that are too long add to its way.
void SensorBiasEstimator::predict(Filter& filter, const Eigen::Isometry3d& T_given, double lever_m) const {
  StateCovariance mixed = StateCovariance::Identity();
  mixed.diagonal().head<6>().setConstant(known_);
  mixed.block<3, 3>(0, 6) = -(1 - known_) * last_->T_given.linear();
  const Eigen::Vector3d way = T_given.translation() - last_->T_given.translation();
  StateCovariance moved = StateCovariance::Identity();
  moved.block<3, 3>(3, 0) = -cross(way);
  moved.block<3, 1>(3, 9) = way;
  filter.state = mixed * filter.state;
  filter.state.head<6>() += (1 - known_) * last_->correction;
  filter.state = moved * filter.state;
  const StateCovariance next = moved * mixed;
  filter.covariance = next * filter.covariance * next.transpose();
  filter.covariance.diagonal().head<6>() +=
      (Twist() << squared(filter.rate_rad), squared(filter.rate_rad * lever_m)).finished();
}

void SensorBiasEstimator::update(Filter& filter, const Eigen::Isometry3d& T_given,
                                 const Alignment& alignment) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6>;
  Twist per_metre;
  per_metre << Eigen::Vector3d::Constant(alignment.lever_m), Eigen::Vector3d::Ones();
  const Rows rows = alignment.directions.leftCols(alignment.determined).transpose() * per_metre.asDiagonal();
  Eigen::Matrix<double, 6, size> of_state = Eigen::Matrix<double, 6, size>::Zero();
  of_state.leftCols<6>().setIdentity();
  of_state.block<3, 3>(0, 6) = T_given.linear();
  const Eigen::Matrix<double, Eigen::Dynamic, size, 0, 6, size> H = rows * of_state;
  const Eigen::Matrix<double, size, Eigen::Dynamic, 0, size, 6> across = filter.covariance * H.transpose();
  const Eigen::MatrixXd S = H * across + rows * alignment.covariance * rows.transpose();
  const Eigen::LLT<Eigen::MatrixXd> solver(S);
  const Eigen::VectorXd innovation = rows * alignment.disagreement - H * filter.state;
  const Eigen::VectorXd weighted = solver.solve(innovation);
  filter.state += across * weighted;
  const StateCovariance after = filter.covariance - across * solver.solve(across.transpose());
  filter.covariance = 0.5 * (after + after.transpose());
  filter.log_determinants += 2 * solver.matrixLLT().diagonal().array().log().sum();
  filter.squares += innovation.dot(weighted);
}

double SensorBiasEstimator::Filter::log_evidence(double numbers) const {
  return -0.5 * (log_determinants + numbers * std::log(squares / numbers));
}

std::optional<SensorBias> SensorBiasEstimator::estimate() const {
  if (numbers_ < numbers_each * size) return {};
  const Filter& best = *std::max_element(filters_.begin(), filters_.end(), [&](const auto& a, const auto& b) {
    return a.log_evidence(numbers_) < b.log_evidence(numbers_);
  });
  const double scatter = std::max(1.0, best.squares / (numbers_ - size));
  return SensorBias{best.state.segment<3>(6), best.state[9],
                    scatter * best.covariance.bottomRightCorner<4, 4>()};
}

}  // namespace octosurf::alignment
