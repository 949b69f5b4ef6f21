#pragma once

#include <algorithm>
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

/// What of the errors of a scan's readings is not noise, as they told where they lay beside the map's
/// surfaces.
struct SharedVariance {
  std::uint8_t range_class = 0;  ///< of distances; 0: of the readings of one surface, along its normal
  double variance = 0;           ///< m², estimated, so that it may come out below 0
};

/// How much the points scatter, by the distance they were seen from, and how far off a plane they
/// may therefore lie: σ(z) = sensor_noise + range_noise·z², tolerance(z) = s + 4·(σ(z) − sensor_noise).
///
/// If `range_noise` is not given it is estimated from the scans themselves: on anything smooth, the
/// second difference of three consecutive readings' ranges is noise alone, of variance 6σ². Its
/// trimmed root mean square, by distance class, leaves out the edges in between and, unlike a median,
/// sees the steps of a sensor that counts depth in steps. Scans whose points are in no
/// order (neighbours far apart) give no estimate and leave the noise at `sensor_noise`.
///
/// Neighbours tell nothing of errors that they share: a camera's depths come in waves and in steps, poses
/// shake. By how much readings lie off surfaces beyond their noise is taken from scans laid on the map, and
/// is a part of reading_variance() alone.
class NoiseModel {
 public:
  static constexpr std::size_t classes = 16, bins = 160;
  static constexpr double least_facing = 0.07;  ///< sine of a stored view's error, about 4°
  using Histogram = std::array<std::array<std::uint32_t, bins>, classes>;

  explicit NoiseModel(const Parameters& parameters);

  double sigma(unsigned range_class) const { return sigma_[range_class]; }
  /// As measured in the scans, where `sigma` never falls below sensor_noise: for weights.
  double measured_sigma(unsigned range_class) const { return measured_sigma_[range_class]; }
  /// How far beyond an edge its readings may lie, m: two `measured_sigma`, rounded up to a millimetre, so
  /// that outlines rarely change while the noise is being estimated.
  double overreach(unsigned range_class) const {
    return std::ceil(2000 * measured_sigma_[range_class]) / 1000;
  }
  /// m², of one reading along the line of sight, about surfaces that other scans have built.
  double reading_variance(unsigned range_class) const {
    return measured_sigma_[range_class] * measured_sigma_[range_class] + shared_[range_class];
  }
  /// m², along a surface's normal, of what all of a scan's readings of it have in common.
  double surface_variance() const { return shared_errors_.of_surface.variance; }
  double tolerance(unsigned range_class) const { return tolerance_[range_class]; }
  /// Off a plane that the line of sight meets at `facing`, the cosine between view and normal: noise
  /// lies along the line of sight, so what is seen along a plane hardly leaves it.
  double tolerance(unsigned range_class, double facing) const {
    const double share = least_facing + (1 - least_facing) * std::fabs(facing);
    return base_tolerance_ + share * (tolerance_[range_class] - base_tolerance_);
  }
  /// The same for whatever knows the class of its distance and the direction it was seen from.
  template <class Point>
  double tolerance(const Point& p, const Plane& plane) const {
    return tolerance(p.range_class, plane.normal.dot(p.view.template cast<double>()));
  }
  /// s, if the parameters say it and do not leave it to be derived.
  std::optional<double> stated_tolerance() const { return stated_tolerance_; }
  /// What no class's tolerance ever exceeds, however the estimates change.
  double largest_tolerance() const;
  /// The parameter, or the smallest that explains all distance classes from 2 m.
  double range_noise() const { return range_noise_; }

  /// Uses one triple of consecutive points in seven, until a class has enough of them.
  void observe(const Scan& scan);
  /// A few readings in a row beside a surface: how far their mean lies off it along the line of sight, m, the
  /// variance of that mean by noise alone, m², and the cosine between that line and the normal.
  struct Residual {
    std::uint8_t range_class = 0;
    std::uint32_t surface = 0;  ///< the same for all on one surface
    double distance = 0, noise_variance = 0, facing = 1;
  };
  /// What residuals of one scan tell. The median of each class with enough of them, which clutter hardly
  /// moves, tells their variance; the medians of the surfaces with enough of them how much of it all of a
  /// scan's readings of a surface share.
  static std::vector<SharedVariance> shared_variances(std::span<const Residual> residuals);
  /// Of one scan; the mean of the last scans' is kept.
  void observe(std::span<const SharedVariance> of_scan);
  static constexpr std::uint32_t residual_memory = 30;  ///< scans: a second of a camera's

  /// What of readings' errors is not noise: its variance, m², and how many scans have told of it.
  struct SharedError {
    double variance = 0;
    std::uint32_t scans = 0;
    void learn(double of_scan);
    void add(const SharedError& other);
  };
  struct SharedErrors {
    std::array<SharedError, classes> of_class;  ///< along the line of sight
    SharedError of_surface;                     ///< of a scan's readings of one, along its normal
  };
  /// Another map's: each counts by the scans that have told of it.
  void add(const SharedErrors& other);
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
