#include "sensing/noise_model.hpp"

#include "geometry/median.hpp"
#include "sensing/reading_code.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace octosurf::sensing {
namespace {

// A stored coordinate is one of 256 steps of a voxel: its deviation in voxels is 1/256/√12.
constexpr double step_deviation = 1 / 886.810013;
constexpr double bin_width = 0.0015;              // m
constexpr std::uint64_t min_observations = 1000;  // before a class is estimated
constexpr double kept_share = 0.95;               // the largest differences are edges, not noise
// How far the ray between two others may lie off their middle, as a share of half their angle: beside a
// missing ray it is a third, at the corner of a triangle all of it. The second difference contains that share
// of a first one, which is the surface's slope.
constexpr float most_uneven = 0.5F;
// Root mean square of the kept part of a normal distribution, relative to its deviation; the variance of a
// second difference is 6 sigma².
constexpr double per_trimmed_rms = 1.148 / 2.449489742783178;
constexpr double smallest_measured_sigma = 0.001;  // m: limited by the accuracy of poses
constexpr double largest_excess = 0.03;            // m; larger values are clutter, not noise

// Minimum residuals of a scan in a class: the error of its median is then a quarter of the deviation, and
// averages out over scans.
constexpr std::size_t enough_residuals = 30;
constexpr double deviation_per_median = 1.4826022;  // of a normal distribution's absolute values

constexpr double per_median = 1.5707963;    // π/2: a median's variance, to a mean's
constexpr std::size_t enough_surfaces = 3;  // per scan: with fewer, a moving or wrong surface could dominate

/// About zero.
double variance_of(std::vector<double> values) {
  for (double& value : values) value = std::fabs(value);
  const double deviation = deviation_per_median * geometry::median_of(values);
  return deviation * deviation;
}

}  // namespace

NoiseModel::NoiseModel(const Parameters& parameters)
    : sensor_noise_(
          std::max(parameters.surfaces.sensor_noise, step_deviation * parameters.occupancy.resolution)),
      base_tolerance_(parameters.surface_tolerance()),
      range_noise_(parameters.surfaces.range_noise.value_or(0)),
      stated_tolerance_(parameters.surfaces.surface_tolerance),
      estimate_(!parameters.surfaces.range_noise) {
  tabulate();
}

void NoiseModel::tabulate() {
  for (unsigned c = 0; c < classes; ++c) {
    const double z = range_of_class(std::max(c, 1U));
    sigma_[c] = sensor_noise_ + (estimate_ ? excess_[c] : range_noise_ * z * z);
    tolerance_[c] = base_tolerance_ + 4 * (sigma_[c] - sensor_noise_);
    measured_sigma_[c] =
        std::max(smallest_measured_sigma,
                 estimate_ && total_[c] >= min_observations ? sigma_of_histogram(c) : sigma_[c]);
  }
}

double NoiseModel::largest_tolerance() const {
  return estimate_ ? base_tolerance_ + 4 * largest_excess : tolerance_[classes - 1];
}

void NoiseModel::observe(const Scan& scan) {
  if (!estimate_) return;
  constexpr std::size_t stride = 7;
  for (std::size_t i = 1; i + 1 < scan.points.size(); i += stride) {
    const Eigen::Vector3f &a = scan.points[i - 1], &b = scan.points[i], &c = scan.points[i + 1];
    const float range = b.norm();
    if (!std::isfinite(range)) continue;
    const unsigned range_class = range_class_of(range);
    if (total_[range_class] >= max_observations) continue;
    // Neighbours on one surface; the comparison is false for NaN.
    if (!((c - a).norm() < 0.05F * range && (b - a).norm() < 0.05F * range)) continue;
    const Eigen::Vector3f to_a = a.normalized(), to_c = c.normalized();
    if (!((to_a - 2 * b / range + to_c).norm() < most_uneven * (to_c - to_a).norm())) continue;
    const double bin = std::fabs(a.norm() - 2 * range + c.norm()) / bin_width;
    if (!(bin < bins)) continue;  // before it is an integer, which has no room for 1e19 m
    ++histogram_[range_class][static_cast<std::size_t>(bin)];
    ++total_[range_class];
  }
  update();
}

double NoiseModel::sigma_of_histogram(unsigned c) const {
  const double kept = kept_share * static_cast<double>(total_[c]);
  double squares = 0, left = kept;
  for (std::size_t bin = 0; bin < bins && left > 0; ++bin) {
    const double n = std::min(left, static_cast<double>(histogram_[c][bin]));
    const double difference = (static_cast<double>(bin) + 0.5) * bin_width;
    squares += n * difference * difference;
    left -= n;
  }
  return std::sqrt(squares / kept) * per_trimmed_rms;
}

void NoiseModel::update() {
  // Each class has its own estimate: a lidar's noise does not grow with z², so nothing is extrapolated. A
  // class with fewer than min_observations uses the nearest estimated one below it.
  range_noise_ = 0;
  double excess = 0;
  for (unsigned c = 1; c < classes; ++c) {
    if (total_[c] >= min_observations) {
      excess = std::clamp(sigma_of_histogram(c) - sensor_noise_, 0.0, largest_excess);
      const double z = range_of_class(c);
      if (z >= 2) range_noise_ = std::max(range_noise_, excess / (z * z));
    }
    excess_[c] = excess;
  }
  tabulate();
}

void NoiseModel::SharedError::learn(double of_scan) {
  scans = std::min(scans + 1, residual_memory);
  variance += (std::max(0.0, of_scan) - variance) / scans;
}

void NoiseModel::SharedError::add(const SharedError& other) {
  if (other.scans == 0) return;
  const double both = scans + other.scans;
  variance = (scans * variance + other.scans * other.variance) / both;
  scans = std::min(scans + other.scans, residual_memory);
}

void NoiseModel::add(const NoiseModel& other) {
  for (unsigned c = 0; c < classes; ++c) shared_errors_.of_class[c].add(other.shared_errors_.of_class[c]);
  shared_errors_.of_surface.add(other.shared_errors_.of_surface);
  tabulate_shared_errors();
  if (!estimate_) return;
  for (unsigned c = 0; c < classes; ++c) {
    for (unsigned bin = 0; bin < bins; ++bin) histogram_[c][bin] += other.histogram_[c][bin];
    total_[c] += other.total_[c];
  }
  update();
}

namespace {

void add_of_classes(std::span<const NoiseModel::Residual> residuals, std::vector<SharedVariance>& found) {
  for (std::uint8_t c = 1; c < NoiseModel::classes; ++c) {
    std::vector<double> distances;
    double noise = 0;
    for (const NoiseModel::Residual& residual : residuals) {
      if (residual.range_class != c) continue;
      distances.push_back(residual.distance);
      noise += residual.noise_variance;
    }
    if (distances.size() < enough_residuals) continue;
    found.push_back({c, variance_of(distances) - noise / static_cast<double>(distances.size())});
  }
}

void add_of_surfaces(std::span<const NoiseModel::Residual> residuals, std::vector<SharedVariance>& found) {
  std::map<std::uint32_t, std::vector<double>> off_plane;
  for (const NoiseModel::Residual& residual : residuals)
    off_plane[residual.surface].push_back(residual.distance * residual.cos_incidence);
  std::vector<double> offsets;
  double unsure = 0;
  for (auto& [surface, distances] : off_plane) {
    if (distances.size() < enough_residuals) continue;
    const double offset = geometry::median_of(distances);
    for (double& distance : distances) distance -= offset;
    unsure += per_median * variance_of(distances) / static_cast<double>(distances.size());
    offsets.push_back(offset);
  }
  if (offsets.size() < enough_surfaces) return;
  found.push_back({0, variance_of(offsets) - unsure / static_cast<double>(offsets.size())});
}

}  // namespace

std::vector<SharedVariance> NoiseModel::shared_variances(std::span<const Residual> residuals) {
  std::vector<SharedVariance> found;
  add_of_classes(residuals, found);
  add_of_surfaces(residuals, found);
  return found;
}

void NoiseModel::observe(std::span<const SharedVariance> of_scan) {
  for (const SharedVariance& shared : of_scan) {
    SharedError& error =
        shared.range_class == 0 ? shared_errors_.of_surface : shared_errors_.of_class[shared.range_class];
    error.learn(shared.variance);
  }
  tabulate_shared_errors();
}

/// A class without estimates uses the nearest one below that has some, or else above.
void NoiseModel::tabulate_shared_errors() {
  const auto& of_class = shared_errors_.of_class;
  const auto known = [](const SharedError& error) { return error.scans > 0; };
  const auto first = std::find_if(of_class.begin(), of_class.end(), known);
  double variance = first == of_class.end() ? 0 : first->variance;
  for (unsigned c = 0; c < classes; ++c) {
    if (known(of_class[c])) variance = of_class[c].variance;
    shared_[c] = variance;
  }
}

void NoiseModel::restore(const Histogram& histogram, double range_noise, const SharedErrors& shared_errors) {
  histogram_ = histogram;
  shared_errors_ = shared_errors;
  tabulate_shared_errors();
  for (std::size_t c = 0; c < classes; ++c)
    total_[c] = std::accumulate(histogram_[c].begin(), histogram_[c].end(), std::uint64_t{0});
  range_noise_ = range_noise;
  estimate_ ? update() : tabulate();
}

}  // namespace octosurf::sensing
