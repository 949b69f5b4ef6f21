#pragma once

#include "alignment/alignment_state.hpp"

#include <Eigen/Core>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// Systematic errors of a sensor in its own frame, the same in every scan: a reading of the place p is seen
/// at (1 + Σ eⱼ(p) θⱼ) p, rotated by the tilt (θ₀, θ₁, θ₂; rad). θ₃ is a scale error of all ranges. The rest
/// is a low-order field: for a camera an error of its disparities, which moves depths by z² times a quadratic
/// over the image; for a lidar an error of its ranges, constant and by the beam's elevation.
using SensorErrors = Eigen::Matrix<double, sensor_error_size, 1>;
using SensorErrorCovariance = Eigen::Matrix<double, sensor_error_size, sensor_error_size>;

/// Derivative by the errors of a reading's distance from a plane with unit normal `n`; both in the sensor's
/// frame.
SensorErrors distance_by_error(SensorKind sensor, const Eigen::Vector3d& reading, const Eigen::Vector3d& n);

/// Prior standard deviations.
SensorErrors usual_errors(SensorKind sensor);

}  // namespace octosurf::alignment
