#include "surfaces/noise_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "occupancy/payload.hpp"

namespace octosurf {
namespace {

constexpr double bin_width = 0.001;        // m
constexpr std::uint64_t enough = 5000;     // observations before a class has a say
constexpr double quantile = 0.6827;        // of |distance|: one standard deviation
constexpr double max_range_noise = 0.004;  // 1/m: 6 cm at 4 m; worse is not noise

}  // namespace

NoiseModel::NoiseModel(const Parameters& parameters)
    : sensor_noise_(parameters.surfaces.sensor_noise),
      base_tolerance_(parameters.surface_tolerance()),
      range_noise_(parameters.surfaces.range_noise.value_or(0)),
      estimate_(!parameters.surfaces.range_noise) {
  tabulate();
}

void NoiseModel::tabulate() {
  for (unsigned c = 0; c < classes; ++c) {
    const double z = range_of_class(std::max(c, 1U));
    sigma_[c] = sensor_noise_ + range_noise_ * z * z;
    tolerance_[c] = base_tolerance_ + 3 * range_noise_ * z * z;
  }
}

void NoiseModel::observe(unsigned range_class, double distance, std::uint32_t count) {
  const auto bin = static_cast<std::size_t>(distance / bin_width);
  if (bin >= bins) return;
  histogram_[range_class][bin] += count;
  total_[range_class] += count;
}

void NoiseModel::update() {
  if (!estimate_) return;
  // Least squares of sigma(z) - sensor_noise = range_noise z² over the classes seen often enough.
  double above = 0, below = 0;
  for (unsigned c = 1; c < classes; ++c) {
    const std::uint64_t total = total_[c];
    if (total < enough) continue;
    std::uint64_t seen = 0;
    std::size_t bin = 0;
    while (static_cast<double>(seen += histogram_[c][bin]) < quantile * static_cast<double>(total)) ++bin;
    const double z = range_of_class(c);
    const double sigma = (static_cast<double>(bin) + 0.5) * bin_width;
    above += (sigma - sensor_noise_) * z * z;
    below += z * z * z * z;
  }
  if (below > 0) range_noise_ = std::clamp(above / below, 0.0, max_range_noise);
  tabulate();
}

void NoiseModel::restore(const Histogram& histogram, double range_noise) {
  histogram_ = histogram;
  for (std::size_t c = 0; c < classes; ++c)
    total_[c] = std::accumulate(histogram_[c].begin(), histogram_[c].end(), std::uint64_t{0});
  range_noise_ = range_noise;
  tabulate();
}

}  // namespace octosurf
