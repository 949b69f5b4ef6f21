#pragma once

#include "sensing/noise_model.hpp"

#include <Eigen/Core>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// A plane that many readings of one scan lie on, sensor's frame.
struct ScanPlane {
  Eigen::Vector3d normal;    ///< unit, toward the sensor
  Eigen::Vector3d centroid;  ///< of its readings
  double readings = 0;       ///< patches' readings, a measure of the plane's area as seen
};

/// The largest planes of a scan, largest first: patches of neighbouring readings that are flat as far as
/// noise lets tell, joined where they lie on one plane. Made from some ten thousand readings, whatever their
/// order. O(readings).
std::vector<ScanPlane> planes_of_scan(const Scan& scan, const sensing::NoiseModel& noise, double min_range,
                                      double max_range, double resolution);

}  // namespace octosurf::alignment
