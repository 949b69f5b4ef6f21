#pragma once

#include <array>
#include <cstdint>

#include <octosurf/parameters.hpp>

namespace octosurf {

/// How much the points scatter, by the distance they were seen from, and how far off a plane they
/// may therefore lie: σ(z) = sensor_noise + range_noise·z², tolerance(z) = s + 3·range_noise·z².
///
/// If `range_noise` is not given it is estimated from the scans: how far off the surfaces that are
/// known their points end, by distance class. The 68 % quantile is σ; objects close to a surface only
/// make the upper ones.
class NoiseModel {
 public:
  static constexpr std::size_t classes = 16, bins = 80;
  using Histogram = std::array<std::array<std::uint32_t, bins>, classes>;

  explicit NoiseModel(const Parameters& parameters);

  double sigma(unsigned range_class) const { return sigma_[range_class]; }
  double tolerance(unsigned range_class) const { return tolerance_[range_class]; }
  double range_noise() const { return range_noise_; }

  /// `count` points ended `distance` m off a known surface.
  void observe(unsigned range_class, double distance, std::uint32_t count);
  bool wants(unsigned range_class) const { return estimate_ && total_[range_class] < plenty; }
  /// Takes the observations so far into account; a no-op if range_noise was given.
  void update();

  const Histogram& histogram() const { return histogram_; }  ///< state, for map files
  void restore(const Histogram& histogram, double range_noise);

 private:
  static constexpr std::uint64_t plenty = 4000000;  // observations after which a class is settled
  void tabulate();

  double sensor_noise_, base_tolerance_, range_noise_ = 0;
  bool estimate_ = false;
  Histogram histogram_{};
  std::array<std::uint64_t, classes> total_{};
  std::array<double, classes> sigma_{}, tolerance_{};
};

}  // namespace octosurf
