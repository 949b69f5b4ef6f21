#pragma once

#include "sensing/noise_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace octosurf::sensing {

/// What a voxel's point says about a plane: one variance, one weight, one gate, for every stage of detection
/// (src/detection). A reading of the plane n·x = offset, seen along the unit vector v (toward the sensor),
/// lies off it by a normal deviation of
///
///   variance = σ_c² · (facing² + ε² (1 − facing²)) + σ_q² + σ_pose²   [m²],   facing = n·v,
///
/// with σ_c the noise along the line of sight as measured for its class of distance, and what readings err
/// beyond it by scans laid on the map (NoiseModel::reading_variance), ε the error of the view that a voxel
/// keeps, and σ_q the rounding of the point in its voxel. A reading that is not the plane's is spread evenly
/// over `clutter_depth`, and its view over the half space; rays that meet a plane meet it by Lambert's cosine
/// law, twice as often head-on as on the mean, hardly ever along it: what a sensor sees beside an edge,
/// between what is before and behind it, lies along its rays. So, for a reading at `distance` off the plane,
///
///   log_ratio = ln(odds · clutter_depth · 2 facing) − ½ ln(2π variance) − distance² / (2 variance)   [nats],
///
/// with facing at least ε, and it belongs to the plane if that is positive: seen head-on at 3.5 deviations
/// for 2 mm of noise, 2.7 for 30 mm. If the parameters state s, readings near the sensor are taken to err by
/// as much as lets them belong to a plane up to s off it, and others by as much more or less.
class ReadingModel {
 public:
  /// Sine of the error of a stored view: it is coded to 3.9° (sensing/reading_code.hpp).
  static constexpr double view_error = NoiseModel::least_facing;
  /// m. What readings of one surface have in common and no number of them averages out, at least, once poses
  /// are aligned: a tenth of a millimetre within one scan, 1 mm in recordings without drift.
  static constexpr double pose_sigma = 0.001;
  /// m. Readings near a plane that are not its: as likely anywhere within the edge of a planelet (8 cm) on
  /// either side, beyond which nobody asks whether they are.
  static constexpr double clutter_depth = 0.16;
  /// Of the readings near a plane those that are not its: what is usual in robust fitting, and a factor of
  /// three either way moves one face in forty.
  static constexpr double outlier_share = 0.1;
  /// Of that share, nats: ln 9.
  static constexpr double log_odds = 2.1972245773362196;

  /// `resolution`: the octree's voxel, m. The noise is taken as it is now.
  ReadingModel(const NoiseModel& noise, double resolution);

  /// m², along a plane's normal. Cost: some additions.
  double variance(unsigned range_class, double facing) const {
    return along_sight_[range_class] * share(facing) + common_;
  }
  /// m², what of it one reading does not share with its neighbours: the noise alone.
  double independent_variance(unsigned range_class, double facing) const {
    return variance(range_class, facing) - pose_sigma * pose_sigma;
  }
  /// m², of what the readings of a surface have in common and no number of them averages out, as the
  /// recording tells: pose_sigma² at least.
  double pose_variance() const { return pose_variance_; }
  /// 1/m², in sums over the readings of a plane.
  double weight(unsigned range_class, double facing) const { return 1 / variance(range_class, facing); }
  /// Nats, positive: the plane's; minus infinity for what is seen from behind, more surely than the view is
  /// known. Cost: a logarithm, about 10 ns.
  double log_ratio(double distance, unsigned range_class, double facing) const {
    if (facing < -view_error) return -std::numeric_limits<double>::infinity();
    return log_peak(range_class, facing) - 0.5 * distance * distance * weight(range_class, facing);
  }
  /// The same for a reading on the plane.
  double log_peak(unsigned range_class, double facing) const {
    const double met = 2 * std::max(facing, view_error);
    return log_scale_ - 0.5 * std::log(variance(range_class, facing) / (met * met));
  }
  /// log_ratio if it is positive, else 0. No reading reaches farther than one that is seen head-on, so that
  /// most need no logarithm.
  double gain(double distance, unsigned range_class, double facing) const {
    if (distance * distance > farthest2_[range_class]) return 0;
    return std::max(0.0, log_ratio(distance, range_class, facing));
  }
  /// The cosine at which readings have such a variance, m²; within [0, 1] what comes nearest.
  double facing_of(unsigned range_class, double variance) const {
    const double seen = (variance - common_) / along_sight_[range_class], hidden = view_error * view_error;
    return std::sqrt(std::clamp((seen - hidden) / (1 - hidden), 0.0, 1.0));
  }
  /// m, off the plane to where a reading stops belonging to it.
  double reach(unsigned range_class, double facing) const {
    return std::sqrt(std::max(0.0, 2 * variance(range_class, facing) * log_peak(range_class, facing)));
  }

 private:
  static double share(double facing) {
    return facing * facing + view_error * view_error * (1 - facing * facing);
  }

  /// Readings of the nearest class, seen head-on, reach so far, m.
  void set_reach(double reach);

  std::array<double, NoiseModel::classes> along_sight_;  // σ_c²
  std::array<double, NoiseModel::classes> farthest2_;    // m², reach() seen head-on, squared
  double common_;                                        // σ_q² + σ_pose²
  double pose_variance_;                                 // m²
  double log_scale_;                                     // ln of odds · clutter_depth / √2π
};

}  // namespace octosurf::sensing
