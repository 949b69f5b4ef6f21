#pragma once

#include "sensing/noise_model.hpp"

#include <Eigen/Core>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// The mean of a few consecutive readings.
struct Sample {
  Eigen::Vector3d point;        ///< mean, sensor frame
  Eigen::Vector3d first, last;  ///< of them
  Eigen::Vector3d origin;       ///< from where they were taken, sensor frame
  double range = 0;             ///< |point - origin|
  double spread = 0;            ///< m: standard deviation of `point` along the line of sight
  double overlap = 1;           ///< mean number of samples that share each of its readings
  Eigen::Vector3d sight() const { return point - origin; }
};

/// Of the readings used, m.
struct RangeLimits {
  double min_m = 0, max_m = 0;
  bool hold(double range) const { return range >= min_m && range > 0 && range <= max_m; }  ///< not for NaN
};

/// Consecutive readings averaged in one sample: at 2.5 m a camera's eight lie within two voxels of 2 cm.
inline constexpr std::size_t most_in_a_row = 8;

/// At most `count` samples of the scan's readings within the limits, spread evenly over it for any order
/// (multiples of the golden ratio). Samples with a spread of more than `most_spread` are skipped. In a scan
/// with few readings samples overlap. O(count), and a word for each reading of the scan.
std::vector<Sample> sample_scan(const Scan& scan, const sensing::NoiseModel& noise, const RangeLimits& limits,
                                std::size_t count, double most_spread);

}  // namespace octosurf::alignment
