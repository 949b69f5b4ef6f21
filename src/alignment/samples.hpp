#pragma once

#include "sensing/noise_model.hpp"

#include <Eigen/Core>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// A few readings in a row, as one.
struct Sample {
  Eigen::Vector3d point;        ///< their mean, sensor's frame
  Eigen::Vector3d first, last;  ///< of them
  double range = 0;             ///< |point|
  double spread = 0;            ///< m: standard deviation of `point` along the line of sight
  double overlap = 1;           ///< samples that each of its readings is part of, in the mean
};

/// Samples with a spread of more than `most_spread` are left out. At most `count` samples of the scan's
/// readings between the ranges, spread evenly over it whatever its order (multiples of the golden ratio). Of
/// a scan with fewer readings than the samples could take up, samples overlap. O(count), and a word for
/// each reading of the scan.
std::vector<Sample> sample_scan(const Scan& scan, const sensing::NoiseModel& noise, std::size_t count,
                                double most_spread, double min_range, double max_range);

}  // namespace octosurf::alignment
