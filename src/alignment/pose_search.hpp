#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_fit.hpp"
#include "alignment/samples.hpp"

#include <optional>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Readings that count.
struct RangeLimits {
  double min_m = 0, max_m = 0;
};

/// One scan and the surfaces about it, looked at for poses that agree.
class PoseSearch {
 public:
  /// All must outlive it. The gate of `errors` is the map's. Surfaces are those that the scan's readings may
  /// meet within `reach` of `start`; `growing` as for NearSurfaces::in().
  PoseSearch(const Snapshot& map, NearSurfaces& surfaces, const Scan& scan, const sensing::NoiseModel& noise,
             const RangeLimits& limits, const Eigen::Isometry3d& start, const AlignmentReach& reach,
             const FitErrors& errors = {}, const GrowingMap* growing = nullptr);

  std::size_t samples() const { return samples_.size(); }
  const AlignmentReach& reach() const { return reach_; }
  /// Plane-to-point from `start`, which may be off by `prior` and a voxel.
  PoseFit fine(const Eigen::Isometry3d& start, const TwistCovariance& prior) const;
  /// The pose within reach of `start` that explains the scan best: planes matched as planes, the best of them
  /// made fine. None if too little is explained, or another pose explains nearly as much.
  std::optional<PoseFit> coarse(const Eigen::Isometry3d& start) const;
  /// As PoseFitter's, with the next.
  Layout lay(const Eigen::Isometry3d& pose) const { return fitter_.lay(pose); }
  std::vector<sensing::NoiseModel::Residual> residuals(const Eigen::Isometry3d& pose) const {
    return fitter_.residuals(pose);
  }
  /// Whether the map contradicts fewer samples at one pose than at another, by so many standard deviations of
  /// what is chance where both poses are as good. Where no surface was seen, it says nothing: on a stair that
  /// goes on, new treads lie on known ones if all is laid a tread too low.
  bool speak_for(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other, double deviations) const;

 private:
  /// m, of a sample from its surface, at a pose within reach.
  double farthest_off() const;
  void keep_best(std::vector<Eigen::Isometry3d>& poses, const Eigen::Isometry3d& start, std::size_t every,
                 std::size_t count) const;

  const Scan& scan_;
  const sensing::NoiseModel& noise_;
  RangeLimits limits_;
  double resolution_;
  AlignmentReach reach_;
  std::vector<Sample> samples_;
  std::vector<const AlignedSurface*> near_;
  PoseFitter fitter_;
};

/// Samples on known surfaces without which nothing is measured.
inline constexpr std::size_t least_known_samples = 100;

/// Standard deviations by which samples must speak for a pose so that it is taken for the right one of two:
/// two, twice as much because neighbouring samples go together.
inline constexpr double by_chance = 4;

/// Independent of each other, rad and m.
TwistCovariance uncertainty(double rotation, double translation);

/// What of the fit is fixed to within half a voxel.
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

/// The fit's pose as far as it is determined, `start` beside that.
Eigen::Isometry3d without_undetermined(const Eigen::Isometry3d& start, const PoseFit& fit,
                                       const Determined& determined);

/// Fills in what Alignment tells of a fit; the covariance `factor`² times what the readings tell.
void describe(const PoseFit& fit, const Determined& determined, double factor, const AlignmentReach& reach,
              Alignment& alignment);

}  // namespace octosurf::alignment
