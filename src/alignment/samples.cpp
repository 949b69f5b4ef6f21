#include "alignment/samples.hpp"

#include "sensing/reading_code.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::alignment {

namespace {

/// Readings in a row that one sample is the mean of: at 2.5 m a camera's eight lie within two voxels of 2 cm.
constexpr std::size_t most_in_a_row = 8;
/// Neighbours on one surface, as a share of the range.
constexpr double nearby = 0.05;

bool within(double range, double min_range, double max_range) {  // NaN fails
  return range >= min_range && range > 0 && range <= max_range;
}

}  // namespace

std::vector<Sample> sample_scan(const Scan& scan, const sensing::NoiseModel& noise, std::size_t count,
                                double most_spread, double min_range, double max_range) {
  std::vector<Sample> samples;
  samples.reserve(count);
  const std::size_t size = scan.points.size();
  constexpr double golden_ratio = 0.6180339887498949;
  double place = 0;  // in the scan, as a share of it
  // Readings that are missing leave their place empty, so that those that are there stay evenly spread.
  for (std::size_t i = 0; i < std::min(count, size); ++i) {
    place += golden_ratio;
    if (place >= 1) place -= 1;
    const std::size_t first = std::min(static_cast<std::size_t>(place * static_cast<double>(size)), size - 1);
    const Eigen::Vector3d start = scan.points[first].cast<double>();
    const double range = start.norm();
    if (!within(range, min_range, max_range)) continue;
    Eigen::Vector3d sum = start, before = start;
    double readings = 1;
    for (std::size_t at = first + 1; at < std::min(first + most_in_a_row, size); ++at, ++readings) {
      const Eigen::Vector3d point = scan.points[at].cast<double>();
      if (!((point - before).norm() < nearby * range)) break;
      sum += point;
      before = point;
    }
    const Eigen::Vector3d mean = sum / readings;
    const double spread =
        noise.measured_sigma(sensing::range_class_of(static_cast<float>(range))) / std::sqrt(readings);
    if (spread <= most_spread) samples.push_back({mean, start, before, mean.norm(), spread});
  }
  return samples;
}

}  // namespace octosurf::alignment
