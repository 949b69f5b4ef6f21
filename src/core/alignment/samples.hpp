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
  double range = 0;             ///< |point|
  double spread = 0;            ///< m: standard deviation of `point` along the line of sight
  double overlap = 1;           ///< mean number of samples that share each of its readings
};

/// At most `count` samples of the scan's readings between the ranges, spread evenly over it for any order
/// (multiples of the golden ratio). Samples with a spread of more than `most_spread` are skipped. In a scan
/// with few readings samples overlap. O(count), and a word for each reading of the scan.
std::vector<Sample> sample_scan(const Scan& scan, const sensing::NoiseModel& noise, std::size_t count,
                                double most_spread, double min_range, double max_range);

}  // namespace octosurf::alignment
