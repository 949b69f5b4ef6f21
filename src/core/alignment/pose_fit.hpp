#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/samples.hpp"
#include "sensing/noise_model.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <span>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// The small motion about the sensor from pose `from` to `to`, and its inverse: `to` = moved(from, twist).
Twist twist_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);
Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Twist& twist);

/// Fills in Alignment's directions, lever and covariance: the first directions have these variances, m², the
/// others are unknown within `reach`.
void set_directions(const TwistCovariance& directions, const Eigen::Ref<const Eigen::VectorXd>& variances,
                    double lever_m, const AlignmentReach& reach, Alignment& alignment);

/// The best pose by scan and surfaces.
struct PoseFit {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  /// Information of the readings alone, at that pose; reduced where the surfaces disagree.
  TwistCovariance information = TwistCovariance::Zero();
  double lever_m = 1;                    ///< root mean square range of the samples used
  std::size_t known = 0, explained = 0;  ///< as in Alignment
  double explained_share() const {
    return known > 0 ? static_cast<double>(explained) / static_cast<double>(known) : 0;
  }
};

/// Tukey's weight of a distance, 0 from `tukey` standard deviations on: 95 % efficient for normal errors
/// (Huber and Ronchetti).
inline constexpr double tukey = 4.685;
inline double tukey_weight(double distance, double deviation) {
  const double share = distance / (tukey * deviation);
  return std::fabs(share) < 1 ? (1 - share * share) * (1 - share * share) : 0;
}

/// A reading matched with a surface.
struct MatchedReading {
  Eigen::Vector3d point;  ///< sensor frame
  const AlignedSurface* surface;
  double variance;  ///< m², along the surface's normal, of the reading alone
};
/// A scan matched with the surfaces that cover it, at one pose.
struct Layout {
  std::vector<MatchedReading> readings;  ///< within the fine gate
  std::size_t known = 0, explained = 0;  ///< as in Alignment
};

/// Assumed errors of a fit.
struct FitErrors {
  double gate_m = 0.06;                              ///< maximum distance of a reading from its surface …
  double fine_gate_m() const { return gate_m / 2; }  ///< … once the pose is nearly right
  double noise_factor = 1;                           ///< on the samples' standard deviations
  double common_m =
      0.0003;  ///< common error of a scan's readings of a surface, m; also their tilt per metre …
  double common_share = 0;  ///< … plus this share of a reading's variance
};

/// Point-to-plane registration of one scan's samples to surfaces.
///
/// Each reading is matched with the nearest surface that covers it and faces the sensor. The pose is found by
/// Gauss–Newton with Tukey's weights. A surface's own error (its covariance, and the common error of a scan's
/// readings of it) adds three unknowns, eliminated per surface, so that a thousand readings of one wall do
/// not determine the pose better than the wall itself is known. Uneven surfaces: readings are weighted by
/// their scatter about their best-fitting plane, if that exceeds their noise (variance components, one a
/// surface).
class PoseFitter {
 public:
  PoseFitter(std::span<const Sample> samples, std::span<const AlignedSurface* const> surfaces,
             const FitErrors& errors);

  /// From `start`, with prior covariance `prior`. O(samples × surfaces), then O(samples) in nine rounds at
  /// most.
  PoseFit fit(const Eigen::Isometry3d& start, const TwistCovariance& prior) const;

  struct Pairing {  ///< a reading and a candidate surface
    std::uint32_t sample, surface;
  };
  /// The surfaces facing the sensor that pass within `reach` m of every `every`-th sample at a pose.
  std::vector<Pairing> pair(const Eigen::Isometry3d& pose, double reach, std::size_t every = 1) const;
  /// Number of paired samples on a surface that covers them at a pose, weighted from 1 down to 0 at the gate.
  double agreement(const Eigen::Isometry3d& pose, std::span<const Pairing> pairings) const;
  /// All samples at a pose. O(samples × surfaces).
  Layout lay(const Eigen::Isometry3d& pose) const;
  /// A sample's state in the map at a pose.
  enum class Verdict {
    none,         ///< no surface covers it
    explained,    ///< on a surface, as counted by PoseFit
    contradicted  ///< off the surfaces that cover it
  };
  /// By sample; surfaces farther away than `reach` m are ignored. O(samples × surfaces).
  std::vector<Verdict> judge(const Eigen::Isometry3d& pose, double reach) const;
  /// Number of samples at a pose that lie behind a surface facing the sensor: the line of sight crosses it.
  /// O(samples × surfaces).
  std::size_t behind_surfaces(const Eigen::Isometry3d& pose) const;
  /// Distances of covered samples from their surface at a pose, except at oblique angles. O(samples ×
  /// surfaces).
  std::vector<sensing::NoiseModel::Residual> residuals(const Eigen::Isometry3d& pose) const;

 private:
  struct Sums;
  struct SurfaceSums;
  struct Match;
  struct Matched;
  struct Linearisation {
    const Eigen::Isometry3d& pose;
    double gate;
    const TwistCovariance& uncertainty;  ///< of the pose: widens the weights' reach
  };
  template <class Visit>
  void for_each_facing(const Eigen::Isometry3d& pose, std::size_t every, const Visit& visit) const;
  Eigen::Vector3d common_of(double reading) const;
  Matched match(const Eigen::Isometry3d& pose, double gate, std::span<const Pairing> candidates) const;
  template <class Visit>
  void for_each_match(const Eigen::Isometry3d& pose, double gate, std::span<const Pairing> pairings,
                      const Visit& visit) const;
  void add_match(const Matched& matched, const TwistCovariance& uncertainty, Sums& sums,
                 std::vector<SurfaceSums>& of_surface) const;
  static double unevenness(const SurfaceSums& of);
  void add_surface(const AlignedSurface& surface, const SurfaceSums& of, Sums& sums) const;
  static double disagreement_ratio(const Sums& sums);
  Sums linearise(const Linearisation& at, std::span<const Pairing> pairings) const;

  std::span<const Sample> samples_;
  std::span<const AlignedSurface* const> surfaces_;
  FitErrors errors_;
};

}  // namespace octosurf::alignment
