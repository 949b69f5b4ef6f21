#pragma once

#include "surfaces/alignment_state.hpp"

#include <Eigen/Core>
#include <cmath>
#include <optional>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

inline constexpr int sensor_error_size = surfaces::sensor_error_size;
/// What a sensor errs by in its own frame, the same in every scan: a reading of the place p is seen at
/// (1 + Σ eⱼ(p) θⱼ) p, turned by the tilt (θ₀, θ₁, θ₂; rad). θ₃ is the share by which all ranges are too
/// long. The rest is a low-order field: of a camera an error of its disparities, which moves depths by z²
/// times a quadratic over the image; of a lidar an error of its ranges, even and by the beam's elevation.
using SensorErrors = Eigen::Matrix<double, sensor_error_size, 1>;
using SensorErrorCovariance = Eigen::Matrix<double, sensor_error_size, sensor_error_size>;

/// Derivative by the errors of a reading's distance off a plane with unit normal `n`; both sensor's frame.
SensorErrors distance_by_error(SensorKind sensor, const Eigen::Vector3d& reading, const Eigen::Vector3d& n);

/// Their estimate.
struct SensorErrorEstimate {
  SensorErrors errors = SensorErrors::Zero();
  SensorErrorCovariance covariance = SensorErrorCovariance::Zero();

  Eigen::Vector3d tilt_rad() const { return errors.head<3>(); }  ///< sensor's axes
  /// Readings 2 m away are too long by this share, in the mean over the view: a scale and a field that grows
  /// with the distance are told apart only by a sensor that sees far and near.
  double range_scale() const { return range_scale_of.dot(errors); }
  double tilt_deviation_rad(int axis) const { return std::sqrt(covariance(axis, axis)); }
  double range_scale_deviation() const { return std::sqrt(range_scale_of.dot(covariance * range_scale_of)); }

  SensorErrors range_scale_of = SensorErrors::Zero();  ///< its derivative by the errors
};
/// None before the first scan that was aligned.
std::optional<SensorErrorEstimate> sensor_error_of(const surfaces::AlignmentState& state);

/// Standard deviations before anything is known.
SensorErrors usual_errors(SensorKind sensor);

}  // namespace octosurf::alignment
