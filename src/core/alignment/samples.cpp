#include "alignment/samples.hpp"

#include "sensing/reading_code.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

namespace octosurf::alignment {

namespace {

/// Neighbours on one surface, as a share of the range.
constexpr double nearby = 0.05;

/// A sample's range of readings in the scan.
struct ReadingRange {
  std::size_t first, end;
};

/// Counts, for each sample, the samples that share its readings.
void note_overlap(const std::vector<ReadingRange>& of_sample, std::vector<Sample>& samples,
                  std::size_t size) {
  std::vector<std::uint32_t> uses(size);
  for (const ReadingRange& r : of_sample)
    for (std::size_t i = r.first; i < r.end; ++i) ++uses[i];
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const ReadingRange& r = of_sample[s];
    const auto sum = std::accumulate(uses.begin() + static_cast<std::ptrdiff_t>(r.first),
                                     uses.begin() + static_cast<std::ptrdiff_t>(r.end), 0.0);
    samples[s].overlap = sum / static_cast<double>(r.end - r.first);
  }
}

}  // namespace

std::vector<Sample> sample_scan(const Scan& scan, const sensing::NoiseModel& noise, const RangeLimits& limits,
                                std::size_t count, double most_spread) {
  std::vector<Sample> samples;
  std::vector<ReadingRange> of_sample;
  samples.reserve(count);
  of_sample.reserve(count);
  const std::size_t size = scan.points.size();
  double place = 0;  // relative position in the scan
  // Missing readings leave their place empty, so that the others stay evenly spread.
  for (std::size_t i = 0; i < std::min(count, size); ++i) {
    place += std::numbers::phi - 1;
    if (place >= 1) place -= 1;
    const std::size_t first = std::min(static_cast<std::size_t>(place * static_cast<double>(size)), size - 1);
    const Eigen::Vector3d start = scan.points[first].cast<double>();
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    if (first < scan.origins.size()) origin = scan.origins[first].cast<double>();
    const double range = (start - origin).norm();
    if (!limits.hold(range)) continue;
    Eigen::Vector3d sum = start, before = start;
    std::size_t at = first + 1;
    for (; at < std::min(first + most_in_a_row, size); ++at) {
      const Eigen::Vector3d point = scan.points[at].cast<double>();
      if (!((point - before).norm() < nearby * range)) break;
      sum += point;
      before = point;
    }
    const auto readings = static_cast<double>(at - first);
    const Eigen::Vector3d mean = sum / readings;
    const double spread =
        noise.measured_sigma(sensing::range_class_of(static_cast<float>(range))) / std::sqrt(readings);
    if (!(spread <= most_spread)) continue;
    samples.push_back({mean, start, before, origin, (mean - origin).norm(), spread});
    of_sample.push_back({first, at});
  }
  note_overlap(of_sample, samples, size);
  return samples;
}

}  // namespace octosurf::alignment
