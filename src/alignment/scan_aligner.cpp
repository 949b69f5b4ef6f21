#include "alignment/scan_aligner.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

namespace octosurf::alignment {
namespace {

/// Of the usual share of explained readings: with less, the pose is looked for farther away.
constexpr double much_less = 0.8;
/// Of the usual share of known readings: with less, the scan may have been taken from elsewhere; and what a
/// pose far off must come to.
constexpr double half_known = 0.5;
/// With which readings' common errors can be told from the pose's.
constexpr std::size_t fewest_surfaces = 4;
/// Memory of the readings' errors, scans; and the most that one scan may say of them, times what is assumed.
constexpr double error_memory = 10, most_noise = 100, most_common = 10;
constexpr std::uint32_t scans_to_learn = 5;
/// Memory of the usual shares, scans.
constexpr double share_memory = 20;
/// Voxels: corrections begin where they exceed what young surfaces are off themselves …
constexpr double least_correction = 1.0 / 10;
/// … and standard deviations of what hangs together in the readings' errors, a depth camera's steps and its
/// bias over the picture: they bend what is matched to them, scan by scan in one direction. Poses taken as
/// given are not bent, so that such a disagreement with the map stays as small as the errors, while that of
/// poses that drift grows.
constexpr double systematic_deviations = 3;
/// A variance is known to have parts beyond the noise model's if it is that much larger.
constexpr double noise_is_known_to = 1.3;
/// Voxels: by less poses may have drifted without anyone noticing, for the octree would not.
constexpr double unnoticed_voxels = 0.5;
/// Voxels by which a pose must be off to have jumped; less is drift's to follow.
constexpr double jump_voxels = 2;
/// Standard deviations by which readings must speak for a correction before drift is believed in: as usual,
/// for that poses drift is for the evidence of many scans to tell.
constexpr double contradicting = 2;
/// How well two scans in a row agree on where the poses have gone: m, rotations by their lever.
constexpr double same_jump_m = 0.03;

PoseMeasurement measurement_of(const PoseFit& fit, const Determined& determined) {
  PoseMeasurement measured;
  measured.T_map_sensor = fit.T_map_sensor;
  const auto directions = determined.directions.leftCols(determined.count);
  measured.directions = directions.transpose() * determined.scale.cwiseInverse().asDiagonal();
  measured.motions = determined.scale.asDiagonal() * directions;
  measured.variances = determined.variances.head(determined.count);
  measured.lever_m = fit.lever_m;
  return measured;
}

/// One scan's turn.
class Turn {
 public:
  Turn(surfaces::AlignmentState& state, const Scan& scan, double resolution)
      : state_(state),
        resolution_(resolution),
        drift_(state, unnoticed_voxels * resolution),
        given_(scan.T_map_sensor),
        expected_(drift_.expected(given_)),
        prior_(drift_.expected_covariance(given_)) {}

  Alignment align(const PoseSearch& search);
  const Eigen::Isometry3d& expected() const { return expected_; }

 private:
  static double known_share(const PoseFit& fit, const Alignment& result) {
    return static_cast<double>(fit.known) / static_cast<double>(std::max<std::size_t>(1, result.samples));
  }
  /// How far the fit lies from where the scan was expected. Along directions that it leaves open it lies
  /// anywhere: a laser's line on a floor and a wall tells no jump, however far it was slid along them.
  double off(const PoseFit& fit, const Determined& determined) const {
    return length(determined, twist_between(expected_, fit.T_map_sensor));
  }
  void learn_errors(const PoseFit& fit);
  void follow(const PoseSearch& search, const PoseFit& fit, const Determined& determined, Alignment& result);
  void note_jump(const PoseFit& fit, const Determined& determined, Alignment& result);
  void leave_as_expected(AlignmentOutcome outcome, Alignment& result) {
    result.T_map_sensor = drift_.update(given_, nullptr);
    result.outcome = outcome;
  }

  surfaces::AlignmentState& state_;
  double resolution_;
  DriftFilter drift_;
  Eigen::Isometry3d given_, expected_;
  TwistCovariance prior_;
};

void Turn::follow(const PoseSearch& search, const PoseFit& fit, const Determined& determined,
                  Alignment& result) {
  const double share = state_.usual_share == 0 ? 1 : 1 / share_memory;
  state_.usual_share += share * (fit.explained_share() - state_.usual_share);
  state_.usual_known += share * (known_share(fit, result) - state_.usual_known);
  learn_errors(fit);
  state_.jump.reset();
  PoseMeasurement measured = measurement_of(fit, determined);
  const double systematic = std::max(0.0, 1 - noise_is_known_to / state_.noise_factor2);
  measured.least_m =
      least_correction * resolution_ + systematic_deviations * fit.spread_m * std::sqrt(systematic);
  // What bends the fit, such as a camera's distortion, leaves most readings on the surfaces at either pose.
  measured.contradicts_given = [&] {
    return search.speak_for(without_undetermined(given_, fit, determined), given_, contradicting);
  };
  // Before the readings' errors are known, covariances say nothing.
  const bool counts = state_.scans_learned >= scans_to_learn;
  result.T_map_sensor = drift_.update(given_, counts ? &measured : nullptr);
  result.outcome = drift_.drifts() ? AlignmentOutcome::corrected : AlignmentOutcome::agrees;
}

void Turn::learn_errors(const PoseFit& fit) {
  if (fit.surfaces == 0) return;
  const double share = 1.0 / std::min<double>(++state_.scans_learned, error_memory);
  const double noise = std::min(most_noise, fit.noise_share * state_.noise_factor2);
  state_.noise_factor2 = std::max(1.0, state_.noise_factor2 + share * (noise - state_.noise_factor2));
  if (fit.surfaces < fewest_surfaces) return;
  // Three numbers a surface, of which the pose has taken up six.
  const double numbers = 3 * static_cast<double>(fit.surfaces), taken = numbers / (numbers - 6);
  const double common = std::min(most_common, fit.common_share * taken);
  state_.common_share = std::max(0.0, state_.common_share + (common - state_.common_share) / error_memory);
}

void Turn::note_jump(const PoseFit& fit, const Determined& determined, Alignment& result) {
  drift_.update(given_, nullptr);
  result.T_map_sensor = without_undetermined(expected_, fit, determined);
  const Eigen::Isometry3d correction = result.T_map_sensor * given_.inverse();
  bool again = false;
  if (state_.jump)
    again = length(determined, twist_between(*state_.jump * given_, fit.T_map_sensor)) < same_jump_m;
  if (again) drift_.jump(correction);
  state_.jump = correction;
  // Where the surfaces leave a direction open, a single scan is as wrong along it as it was elsewhere. Poses
  // that have moved for good are left as given there.
  result.outcome = determined.count == 6 || again ? AlignmentOutcome::recovered : AlignmentOutcome::set_aside;
}

Alignment Turn::align(const PoseSearch& search) {
  Alignment result;
  result.samples = search.samples();
  PoseFit fit = search.fine(expected_, prior_);
  Determined determined = determined_by(fit, resolution_);
  const double jump = jump_voxels * resolution_;
  const bool known = fit.known >= least_known_samples;
  const bool explained = fit.explained_share() >= much_less * state_.usual_share;
  const bool fits = explained && off(fit, determined) <= jump;
  // A view that is suddenly unknown may be one of new places, or one from elsewhere than the pose says.
  const bool strange = known_share(fit, result) < half_known * state_.usual_known;
  const std::optional<PoseFit> found = (known && !fits) || strange ? search.coarse(expected_) : std::nullopt;
  const bool takes = found && known_share(*found, result) >= half_known * state_.usual_known;
  if (takes) {
    fit = *found;
    determined = determined_by(fit, resolution_);
  }
  // It has jumped only if neither drift nor the measurement's error can have brought it there, and the pose
  // that was expected explains the scan worse.
  const bool jumped = takes && off(fit, determined) > jump &&
                      !drift_.may_lie(given_, measurement_of(fit, determined)) &&
                      search.speak_for(fit.T_map_sensor, expected_, by_chance);
  if (jumped)
    note_jump(fit, determined, result);
  else if (!takes && (!known || (fits && determined.count == 0)))
    leave_as_expected(AlignmentOutcome::nothing_known, result);
  else if (takes || fits)
    follow(search, fit, determined, result);
  else
    leave_as_expected(AlignmentOutcome::unexplained, result);
  describe(fit, determined, drift_.factor(), search.reach(), result);
  result.disagreement = twist_between(given_, fit.T_map_sensor);
  result.innovation_m = length(determined, twist_between(expected_, fit.T_map_sensor));
  return result;
}

}  // namespace

ScanAligner::Result ScanAligner::operator()(surfaces::AlignmentState& state, const Snapshot& map,
                                            const GrowingMap& growing, const Scan& scan,
                                            const RangeLimits& limits) {
  Turn turn(state, scan, map.resolution);
  const PoseSearch poses = search(turn.expected(), state, map, growing, scan, limits);
  Result result{turn.align(poses), {}};
  const AlignmentOutcome outcome = result.alignment.outcome;
  if (outcome != AlignmentOutcome::unexplained && outcome != AlignmentOutcome::set_aside)
    result.residuals = poses.residuals(result.alignment.T_map_sensor);
  return result;
}

ScanAligner::Result ScanAligner::as_given(const surfaces::AlignmentState& state, const Snapshot& map,
                                          const GrowingMap& growing, const Scan& scan,
                                          const RangeLimits& limits) {
  Result result;
  result.alignment.T_map_sensor = scan.T_map_sensor;
  result.residuals =
      search(scan.T_map_sensor, state, map, growing, scan, limits).residuals(scan.T_map_sensor);
  return result;
}

PoseSearch ScanAligner::search(const Eigen::Isometry3d& start, const surfaces::AlignmentState& state,
                               const Snapshot& map, const GrowingMap& growing, const Scan& scan,
                               const RangeLimits& limits) {
  const FitErrors errors{.noise_factor = std::sqrt(state.noise_factor2), .common_share = state.common_share};
  return {map, surfaces_, scan, growing.noise, limits, start, AlignmentReach(), errors, &growing};
}

}  // namespace octosurf::alignment
