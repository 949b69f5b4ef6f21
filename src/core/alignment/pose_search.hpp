#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_fit.hpp"
#include "alignment/samples.hpp"

#include <optional>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Searches poses of one scan that agree with the surrounding surfaces.
class PoseSearch {
 public:
  /// All must outlive it. The gate of `errors` is the map's. Uses the surfaces that the scan's readings may
  /// meet within `reach` of `start`; `growing` as for NearSurfaces::in().
  PoseSearch(const Snapshot& map, NearSurfaces& surfaces, const Scan& scan, const sensing::NoiseModel& noise,
             const RangeLimits& limits, const Eigen::Isometry3d& start, const AlignmentReach& reach,
             const FitErrors& errors = {}, const surfaces::MapState* growing = nullptr);

  const Scan& scan() const { return scan_; }
  const sensing::NoiseModel& noise() const { return noise_; }
  const RangeLimits& limits() const { return limits_; }
  std::size_t samples() const { return samples_.size(); }
  const std::vector<Sample>& all_samples() const { return samples_; }
  const AlignmentReach& reach() const { return reach_; }
  /// Point-to-plane registration from `start`, with an error of `prior` and a voxel.
  PoseFit fine(const Eigen::Isometry3d& start, const TwistCovariance& prior) const;
  /// The pose within reach of `start` that explains the scan best: candidates from matched planes, the best
  /// ones refined. Of poses that explain about as much, the one of which the octree contradicts least. None
  /// if too little is explained, or another pose is as good.
  std::optional<PoseFit> coarse(const Eigen::Isometry3d& start, const OccupancyView& octree) const;
  /// The refined candidates, of which that is one.
  std::vector<PoseFit> candidates(const Eigen::Isometry3d& start) const;
  /// Of the scan's samples and those surfaces.
  const PoseFitter& fitter() const { return fitter_; }
  /// Whether the map contradicts significantly fewer samples at one pose than at another, in standard
  /// deviations under the hypothesis that both are equally good. Unseen places do not count: on a stair, new
  /// treads would lie on known ones if everything is placed one tread too low.
  bool speak_for(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other, double deviations) const;

 private:
  /// m, of a sample from its surface, at a pose within reach.
  double farthest_off() const;
  std::vector<Eigen::Isometry3d> starts_around(const Eigen::Isometry3d& start) const;
  void add_candidates(const Eigen::Isometry3d& start, std::vector<PoseFit>& fits) const;
  std::optional<PoseFit> least_contradicted(const std::vector<const PoseFit*>& fits,
                                            const OccupancyView& octree) const;
  void keep_best(std::vector<Eigen::Isometry3d>& poses, const Eigen::Isometry3d& start, std::size_t every,
                 std::size_t count) const;

  const Scan& scan_;
  const sensing::NoiseModel& noise_;
  RangeLimits limits_;
  double resolution_;
  AlignmentReach reach_;
  double turn_rad_;  ///< the reach from each of the poses at which the search begins
  std::vector<Sample> samples_;
  std::vector<const AlignedSurface*> near_;
  PoseFitter fitter_;
};

/// Minimum number of samples on known surfaces for a measurement.
inline constexpr std::size_t least_known_samples = 100;

/// The most that a search may reach, m; and from each of the poses where it begins, rad: planes are matched
/// by linear equations of the turn, which errs by 2 % of 20°.
inline constexpr double most_reach_m = 10, most_turn_rad = 0.35;

/// Standard deviations by which samples must favour one of two poses: two, doubled because neighbouring
/// samples are correlated.
inline constexpr double by_chance = 4;

/// Whether a pose explains enough of what is known.
bool is_explained(const PoseFit& fit);
/// Whether a pose explains a scan as well as the better one `best`: the numbers of explained samples do not
/// differ significantly, as the unexplained ones have the square root of their number as error.
bool explains_as_well(const PoseFit& fit, const PoseFit& best);

/// Covariance of independent rotations (rad) and translations (m).
TwistCovariance uncertainty(double rotation, double translation);

/// The directions of a fit determined to within half a voxel.
struct Determined {
  TwistCovariance directions;  ///< as Alignment::directions
  Twist variances;             ///< of the directions, m²
  int count = 0;
  Twist scale;  ///< a twist's units per metre
};
/// Of the twist's determined part, m.
double length(const Determined& determined, const Twist& twist);
/// The same in standard deviations.
double deviations(const Determined& determined, const Twist& twist);
Determined determined_by(const PoseFit& fit, double resolution);

/// The fit's pose along determined directions, `start` along the others.
Eigen::Isometry3d without_undetermined(const Eigen::Isometry3d& start, const PoseFit& fit,
                                       const Determined& determined);

/// Fills in Alignment from a fit.
void describe(const PoseFit& fit, const Determined& determined, const AlignmentReach& reach,
              Alignment& alignment);

}  // namespace octosurf::alignment
