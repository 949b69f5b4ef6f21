#pragma once

#include "sensing/noise_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace octosurf::sensing {

/// Likelihood of a voxel's point under a plane: one variance, one weight, one gate, for all stages of
/// detection (src/core/detection). A reading of the plane n·x = offset, seen along the unit vector v (toward
/// the sensor), has a normally distributed distance from it with
///
///   variance = σ_c² · (c² + ε² (1 − c²)) + σ_q² + σ_pose²   [m²],   c = cosine = n·v of incidence,
///
/// where σ_c is the error along the line of sight for its range class (measured noise plus the deviation of
/// scans aligned with the map, NoiseModel::reading_variance), ε the error of the stored view, and σ_q the
/// rounding of the point in its voxel. A clutter reading is uniform over `clutter_depth`, its view over the
/// half space; rays meet a plane by Lambert's cosine law, twice as often head-on as on average and hardly
/// ever at grazing angles, where mixed readings beside an edge lie. So, for a reading at `distance` off the
/// plane,
///
///   log_ratio = ln(odds · clutter_depth · 2 c) − ½ ln(2π variance) − distance² / (2 variance)   [nats],
///
/// with c at least ε, and the reading belongs to the plane if that is positive: seen head-on
/// within 3.5 deviations for 2 mm of noise, 2.7 for 30 mm. If the parameters set s, the nearest class's
/// variance is chosen to give it the reach s, and the other classes' scale with it.
class ReadingModel {
 public:
  /// Sine of the error of a stored view, which is coded to 3.9° (sensing/reading_code.hpp): the least cosine
  /// of incidence that is told from 0.
  static constexpr double view_error = 0.07;
  /// Least cosine of incidence at which a reading surely is the surface's: at grazing angles it may belong to
  /// objects in front or behind.
  static constexpr double grazing_cosine = 0.15;
  /// m. Minimum common error of readings of one surface, which does not average out, once poses are aligned:
  /// a tenth of a millimetre within one scan, 1 mm in recordings without drift.
  static constexpr double pose_sigma = 0.001;
  /// m. Depth of clutter near a plane: uniform within the edge of a seed patch (8 cm) on either side, the
  /// largest distance that is considered.
  static constexpr double clutter_depth = 0.16;
  /// Share of clutter among readings near a plane: a usual value in robust fitting; changing it by a factor
  /// of three affects one face in forty.
  static constexpr double outlier_share = 0.1;
  /// Prior log-odds from that share, nats: ln 9.
  static constexpr double log_odds = 2.1972245773362196;

  /// `resolution`: the octree's voxel, m. Copies the current noise estimates.
  ReadingModel(const NoiseModel& noise, double resolution);

  /// m², along a plane's normal. Cost: some additions.
  double variance(unsigned range_class, double cosine) const {
    return along_sight_[range_class] * share(cosine) + common_;
  }
  /// m², the part of a reading's variance that is independent of its neighbours: the noise alone.
  double independent_variance(unsigned range_class, double cosine) const {
    return variance(range_class, cosine) - pose_sigma * pose_sigma;
  }
  /// m², common error of a surface's readings in this recording, which does not average out: pose_sigma² at
  /// least.
  double pose_variance() const { return pose_variance_; }
  /// 1/m², weight in sums over a plane's readings.
  double weight(unsigned range_class, double cosine) const { return 1 / variance(range_class, cosine); }
  /// Nats, positive if it belongs to the plane; minus infinity for a reading seen from behind, beyond the
  /// view's error. Cost: a logarithm, about 10 ns.
  double log_ratio(double distance, unsigned range_class, double cosine) const {
    if (cosine < -view_error) return -std::numeric_limits<double>::infinity();
    return log_peak(range_class, cosine) - 0.5 * distance * distance * weight(range_class, cosine);
  }
  /// Of a point with a range class and a view direction.
  template <class Point>
  double log_ratio(const Point& p, const Plane& plane) const {
    return log_ratio(plane.signed_distance(p.position.template cast<double>()), p.range_class,
                     plane.normal.dot(p.view.template cast<double>()));
  }
  template <class Point>
  bool belongs(const Point& p, const Plane& plane) const {
    return log_ratio(p, plane) > 0;
  }
  /// log_ratio for a reading on the plane.
  double log_peak(unsigned range_class, double cosine) const {
    const double met = 2 * std::max(cosine, view_error);
    return log_scale_ - 0.5 * std::log(variance(range_class, cosine) / (met * met));
  }
  /// Whether no reading so far off belongs to the plane: those seen head-on have the largest reach.
  bool out_of_reach(double distance, unsigned range_class) const {
    return distance * distance > farthest2_[range_class];
  }
  /// log_ratio if it is positive, else 0. Most readings that do not belong need no logarithm.
  double gain(double distance, unsigned range_class, double cosine) const {
    if (out_of_reach(distance, range_class)) return 0;
    return std::max(0.0, log_ratio(distance, range_class, cosine));
  }
  /// The cosine at which readings have this variance, m², clamped to [0, 1].
  double cos_incidence_of(unsigned range_class, double variance) const {
    const double seen = (variance - common_) / along_sight_[range_class], hidden = view_error * view_error;
    return std::sqrt(std::clamp((seen - hidden) / (1 - hidden), 0.0, 1.0));
  }
  /// m, distance from the plane at which a reading no longer belongs to it.
  double reach(unsigned range_class, double cosine) const {
    return std::sqrt(std::max(0.0, 2 * variance(range_class, cosine) * log_peak(range_class, cosine)));
  }

 private:
  static double share(double cosine) {
    return cosine * cosine + view_error * view_error * (1 - cosine * cosine);
  }

  /// Sets the reach of readings of the nearest class, seen head-on, m.
  void set_reach(double reach);

  std::array<double, NoiseModel::classes> along_sight_;  // σ_c²
  std::array<double, NoiseModel::classes> farthest2_;    // m², reach() seen head-on, squared
  double common_;                                        // σ_q² + σ_pose²
  double pose_variance_;                                 // m²
  double log_scale_;                                     // ln of odds · clutter_depth / √2π
};

}  // namespace octosurf::sensing
