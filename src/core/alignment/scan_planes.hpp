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
  double readings = 0;       ///< patches' readings, a measure of the visible area
};

/// The largest planes of a scan, largest first: patches of neighbouring readings that are flat within noise,
/// joined where they are coplanar. Uses some ten thousand readings, independent of their order. O(readings).
std::vector<ScanPlane> planes_of_scan(const Scan& scan, const sensing::NoiseModel& noise, double min_range,
                                      double max_range, double resolution);

}  // namespace octosurf::alignment
