#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::sensing {

/// The part of a scan's reading errors that is not noise, estimated from residuals on the map's surfaces.
struct SharedVariance {
  std::uint8_t range_class = 0;  ///< of distances; 0: of the readings of one surface, along its normal
  double variance = 0;           ///< m², estimated, so that it may come out below 0
};

/// How much the points scatter, by the distance they were seen from, and so how far off a cylinder they may
/// lie: σ(z) = sensor_noise + range_noise·z², tolerance(z) = s + 4·(σ(z) − sensor_noise).
///
/// If `range_noise` is not given, it is estimated from the scans: on smooth surfaces the second difference of
/// three consecutive ranges is pure noise, of variance 6σ². Its trimmed root mean square, by range class,
/// excludes edges and, unlike a median, includes the quantisation steps of a sensor. Scans with unordered
/// points (neighbours far apart) give no estimate and leave the noise at `sensor_noise`.
///
/// Differences of neighbours do not contain errors that they share: a camera's depth distortion and steps,
/// pose jitter. The readings' deviation from surfaces beyond noise is estimated from scans aligned with the
/// map, and affects reading_variance() only.
class NoiseModel {
 public:
  static constexpr std::size_t classes = 16, bins = 160;
  using Histogram = std::array<std::array<std::uint32_t, bins>, classes>;

  explicit NoiseModel(const Parameters& parameters);

  double sigma(unsigned range_class) const { return sigma_[range_class]; }
  /// Measured value, used for weights, whereas `sigma` is at least sensor_noise.
  double measured_sigma(unsigned range_class) const { return measured_sigma_[range_class]; }
  /// Assumed extent of readings beyond an edge, m: two `measured_sigma`, rounded up to a millimetre, so that
  /// outlines rarely change while the noise is being estimated.
  double edge_bleed(unsigned range_class) const {
    return std::ceil(2000 * measured_sigma_[range_class]) / 1000;
  }
  /// m², of one reading along the line of sight, relative to surfaces built from other scans.
  double reading_variance(unsigned range_class) const {
    return measured_sigma_[range_class] * measured_sigma_[range_class] + shared_[range_class];
  }
  /// m², along a surface's normal, of the error common to a scan's readings of it.
  double surface_variance() const { return shared_errors_.of_surface.variance; }
  /// m, off a cylinder's lateral surface; planes have ReadingModel.
  double tolerance(unsigned range_class) const { return tolerance_[range_class]; }
  /// s, if given explicitly in the parameters.
  std::optional<double> stated_tolerance() const { return stated_tolerance_; }
  /// Upper bound of any class's tolerance, for any estimates.
  double largest_tolerance() const;
  /// The parameter, or the smallest value that covers all range classes from 2 m.
  double range_noise() const { return range_noise_; }

  /// Uses one triple of consecutive points in seven, until a class has enough of them.
  void observe(const Scan& scan);
  /// A few readings in a row beside a surface: how far their mean lies off it along the line of sight, m, the
  /// variance of that mean by noise alone, m², and the cosine between that line and the normal.
  struct Residual {
    std::uint8_t range_class = 0;
    std::uint32_t surface = 0;  ///< identifies the surface
    double distance = 0, noise_variance = 0, cos_incidence = 1;
  };
  /// Estimates shared variances from residuals of one scan. The median of each class with enough residuals,
  /// which is robust to clutter, gives the class's variance; the medians of the surfaces with enough of them
  /// give the part common to all of a scan's readings of a surface.
  static std::vector<SharedVariance> shared_variances(std::span<const Residual> residuals);
  /// Adds one scan's estimates to a moving average.
  void observe(std::span<const SharedVariance> of_scan);
  static constexpr std::uint32_t residual_memory = 30;  ///< scans: a second of a camera's

  /// The variance of errors that are not noise, m², and the number of scans it was estimated from.
  struct SharedError {
    double variance = 0;
    std::uint32_t scans = 0;
    void learn(double of_scan);
    void add(const SharedError& other);
  };
  struct SharedErrors {
    std::array<SharedError, classes> of_class;  ///< along the line of sight
    SharedError of_surface;                     ///< common to a scan's readings of one, along its normal
  };
  /// Adds another map's observations, and its estimates weighted by their numbers of scans.
  void add(const NoiseModel& other);
  const Histogram& histogram() const { return histogram_; }  ///< state, for map files, with the next
  const SharedErrors& shared_errors() const { return shared_errors_; }
  void restore(const Histogram& histogram, double range_noise, const SharedErrors& shared_errors);

 private:
  static constexpr std::uint64_t max_observations = 1000000;  // a class with more is estimated well enough
  double sigma_of_histogram(unsigned range_class) const;
  void update();
  void tabulate();
  void tabulate_shared_errors();

  double sensor_noise_, base_tolerance_, range_noise_ = 0;
  std::optional<double> stated_tolerance_;
  bool estimate_ = false;
  Histogram histogram_{};
  std::array<std::uint64_t, classes> total_{};
  std::array<double, classes> excess_{};  // σ − sensor_noise, estimated
  std::array<double, classes> sigma_{}, tolerance_{}, measured_sigma_{};
  SharedErrors shared_errors_{};
  std::array<double, classes> shared_{};  // m², of every class
};

}  // namespace octosurf::sensing
