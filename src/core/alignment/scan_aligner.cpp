#include "alignment/scan_aligner.hpp"

#include "alignment/drift_filter.hpp"
#include "alignment/revisit.hpp"
#include "sensing/reading_code.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>

namespace octosurf::alignment {
namespace {

/// Of the usual share of known readings: below it, the scan may be from elsewhere; also the minimum for
/// accepting a distant pose.
constexpr double half_known = 0.5;
/// Time constants of the patches' scatter (views) and of the usual shares (scans).
constexpr double scatter_memory = 10, share_memory = 20;
/// Of the usual share of explained readings: below it, the pose is searched for farther away.
constexpr double much_less = 0.8;
/// Common error of a surface's readings, as a share of their variance: half.
constexpr double common_share = 0.5;
/// Minimum pose error of a jump, in voxels; smaller errors are drift.
constexpr double jump_voxels = 2;
/// Standard deviations of the fit for a jump: heavy-tailed errors (Student's t with four degrees of freedom)
/// reach this once in ten thousand scans. A laser line that slid along a wall seems to be off by eight.
constexpr double not_by_chance = 15.5;
/// Maximum difference between two consecutive scans' jumps: m, rotations by their lever.
constexpr double same_jump_m = 0.03;

/// Alignment of one scan.
class ScanAlignment {
 public:
  /// `result`: with the state before the scan; align() fills it in.
  ScanAlignment(AlignedScan& result, const SeenPatches& patches, const Scan& scan,
                const Parameters& parameters)
      : result_(result),
        state_(result.state),
        patches_(patches),
        scan_(scan),
        resolution_(parameters.occupancy.resolution),
        drift_(state_, scan.sensor, resolution_, parameters.up.value_or(Eigen::Vector3d::UnitZ())),
        given_(scan.T_map_sensor) {
    drift_.advance(given_);
    expected_ = drift_.pose();
  }

  /// `rejects`: whether the scan contradicts the octree at the expected pose; called if it fits nowhere.
  void align(const PoseSearch& search, const std::function<bool()>& rejects);
  const Eigen::Isometry3d& expected() const { return expected_; }

 private:
  static double share_of(std::size_t count, std::size_t all) {
    return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, all));
  }
  bool is_explained(double share) const { return share >= much_less * state_.usual_share; }
  bool found_elsewhere(const PoseSearch& search, const PoseFit& fit, const Determined& determined) const;
  bool is_worth_a_search(double known_share) const;
  void note_jump(const PoseFit& fit, const Determined& determined);
  void learn();
  void follow(const Layout& layout);

  AlignedScan& result_;
  AlignmentState& state_;
  const SeenPatches& patches_;
  const Scan& scan_;
  double resolution_;
  DriftFilter drift_;
  Eigen::Isometry3d given_, expected_;
};

/// Updates the usual shares of known and explained readings, also from scans that fit worse.
void ScanAlignment::learn() {
  const Alignment& alignment = result_.alignment;
  const double share = state_.usual_share == 0 ? 1 : 1 / share_memory;
  state_.usual_share += share * (alignment.explained_share() - state_.usual_share);
  state_.usual_known += share * (share_of(alignment.known, alignment.samples) - state_.usual_known);
  state_.jump.reset();
}

/// Estimates drift from patches seen long ago.
void ScanAlignment::follow(const Layout& layout) {
  Alignment& alignment = result_.alignment;
  if (drift_.is_new_view()) {
    auto observed = observe(scan_, expected_, layout.readings, patches_, state_.sensor, resolution_);
    const SensorErrors errors = drift_.sensor_errors();
    const Revisit revisit = measure(observed, state_.travelled_m, errors, state_.patch_m, resolution_);
    describe(revisit, errors, result_.alignment);
    if (revisit.patches > 0) {
      alignment.disagreement += twist_between(given_, expected_);
      if (revisit.scatter_m > 0)  // too few patches have none
        state_.patch_m += (revisit.scatter_m - state_.patch_m) / scatter_memory;
      drift_.learn(expected_, revisit);
    }
    state_.view_m = state_.travelled_m;
    const Twist moved_on = twist_between(expected_, drift_.pose());
    for (auto& [key, patch, weight, distance, by_pose, by_error] : observed) {
      Observation now;
      now.weight = static_cast<float>(1 / (1 / weight + state_.patch_m * state_.patch_m));
      now.distance = static_cast<float>(distance + by_pose.dot(moved_on));
      now.by_error = by_error.cast<float>();
      if (!(patch.recent.weight > 0 || patch.past.weight > 0)) patch.since = state_.travelled_m;
      patch.add(now, state_.travelled_m, revisit_span_m);
      result_.patches.emplace_back(key, patch);
    }
  }
  alignment.T_map_sensor = drift_.pose();
  alignment.outcome = drift_.drifts() ? AlignmentOutcome::corrected : AlignmentOutcome::agrees;
}

/// A distant pose is accepted if the previous scan was there, too.
void ScanAlignment::note_jump(const PoseFit& fit, const Determined& determined) {
  Alignment& alignment = result_.alignment;
  const Eigen::Isometry3d there = without_undetermined(expected_, fit, determined);
  const Eigen::Isometry3d correction = there * given_.inverse();
  const bool again =
      state_.jump && length(determined, twist_between(*state_.jump * given_, fit.T_map_sensor)) < same_jump_m;
  alignment.T_map_sensor = there;
  alignment.outcome = again ? AlignmentOutcome::recovered : AlignmentOutcome::rejected;
  if (again) {
    drift_.jump(correction);
    state_.jump.reset();
  } else {
    state_.jump = correction;
  }
}

/// Accepts another place only if it explains the scan better than the expected one, by more than drift
/// allows.
bool ScanAlignment::found_elsewhere(const PoseSearch& search, const PoseFit& fit,
                                    const Determined& determined) const {
  const Twist off = twist_between(expected_, fit.T_map_sensor);
  return share_of(fit.known, search.samples()) >= half_known * state_.usual_known &&
         length(determined, off) > jump_voxels * resolution_ && deviations(determined, off) > not_by_chance &&
         search.speak_for(fit.T_map_sensor, expected_, by_chance);
}

/// A failed search is repeated only if the view has changed or fits worse: otherwise each of a run of scans
/// with unexplained poses would be searched for, at twenty times the cost.
bool ScanAlignment::is_worth_a_search(double known_share) const {
  const auto& failed_search = state_.failed_search;
  return !failed_search || state_.travelled_m - failed_search->travelled_m >= revisit_span_m ||
         known_share < half_known * failed_search->known ||
         result_.alignment.explained_share() < much_less * failed_search->share;
}

void ScanAlignment::align(const PoseSearch& search, const std::function<bool()>& rejects) {
  Alignment& alignment = result_.alignment;
  const Layout layout = search.fitter().lay(expected_);
  alignment.samples = search.samples();
  alignment.known = layout.known;
  alignment.explained = layout.explained;
  alignment.T_map_sensor = expected_;
  const bool known = layout.known >= least_known_samples;
  // A sudden drop of the known share means new places, or a wrong pose.
  const double known_share = share_of(layout.known, search.samples());
  const bool strange = known_share < half_known * state_.usual_known;
  bool fits = known && is_explained(alignment.explained_share());
  const bool doubtful = (known && !fits) || strange;
  if (!doubtful) state_.failed_search.reset();
  if (doubtful && is_worth_a_search(known_share)) {
    const AlignmentState::Search here{known_share, alignment.explained_share(), state_.travelled_m};
    const PoseFit near = search.fine(expected_, drift_.covariance());
    const bool drifted = near.known >= least_known_samples && is_explained(near.explained_share()) &&
                         length(determined_by(near, resolution_),
                                twist_between(expected_, near.T_map_sensor)) <= jump_voxels * resolution_;
    fits = fits || drifted;
    const std::optional<PoseFit> found = fits && !strange ? std::nullopt : search.coarse(expected_);
    if (found) {
      const Determined determined = determined_by(*found, resolution_);
      alignment.known = found->known;
      alignment.explained = found->explained;
      if (found_elsewhere(search, *found, determined)) {
        describe(*found, determined, search.reach(), alignment);
        alignment.disagreement = twist_between(given_, found->T_map_sensor);
        alignment.innovation_m = length(determined, twist_between(expected_, found->T_map_sensor));
        note_jump(*found, determined);
        return;
      }
      fits = true;
    }
    if (!fits || strange) state_.failed_search = here;
  }
  if (!(known && fits) && rejects()) {
    alignment.outcome = AlignmentOutcome::rejected;
    return;
  }
  follow(layout);
  if (known) learn();
  if (known && !fits)
    alignment.outcome = AlignmentOutcome::unexplained;
  else if (!known && !drift_.drifts())
    alignment.outcome = AlignmentOutcome::nothing_known;
}

/// m, of the readings within `most`.
double farthest_reading(const Scan& scan, double most) {
  float farthest = 0;
  for (const Eigen::Vector3f& point : scan.points)
    if (const float range = point.norm(); range <= static_cast<float>(most))  // NaN fails
      farthest = std::max(farthest, range);
  return farthest;
}

/// Half of what is compared of a scan contradicts the octree, in both ways: what came stands in free space,
/// what went is seen through, but a wrong pose does both.
bool contradicts(const surfaces::MapState& map, const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                 const RangeLimits& limits) {
  constexpr std::size_t samples = 400;  // effort: a share of 50 % is then known to 2.5 %
  constexpr std::size_t fewest_compared = 100, both_ways = 10;  // a tenth each
  const double d = map.parameters.occupancy.resolution;
  std::vector<occupancy::SightLine> lines;
  for (std::size_t k = 0; k < samples && !scan.points.empty(); ++k) {
    // Multiples of the golden ratio spread evenly over pictures and rings of any size.
    const double place = std::fmod(static_cast<double>(k) * std::numbers::phi, 1);
    const auto i = static_cast<std::size_t>(place * static_cast<double>(scan.points.size()));
    const Eigen::Vector3d p = scan.points[i].cast<double>();
    Eigen::Vector3d start = Eigen::Vector3d::Zero();
    if (i < scan.origins.size()) start = scan.origins[i].cast<double>();
    const double range = (p - start).norm();
    if (!(range >= limits.min_m && range <= limits.max_m)) continue;  // NaN
    const unsigned range_class = sensing::range_class_of(static_cast<float>(range)) & 0xf;
    // Within a voxel and a deviation; with three, half of what a jump of 10 cm contradicts is near enough.
    lines.push_back(
        {T_map_sensor * start, T_map_sensor * p, d + std::sqrt(map.noise.reading_variance(range_class))});
  }
  const occupancy::Agreement agreement = map.occupancy.agreement_with(lines);
  const std::size_t compared = agreement.agrees + agreement.in_free_space + agreement.behind_matter;
  return compared >= fewest_compared && 2 * agreement.agrees < compared &&
         both_ways * agreement.in_free_space >= compared && both_ways * agreement.behind_matter >= compared;
}

}  // namespace

AlignedScan ScanAligner::operator()(const surfaces::MapState& map, const Scan& scan,
                                    const RangeLimits& limits) {
  const AlignmentRecord& record = record_of(map);
  AlignedScan result;
  result.state = record.state;
  result.alignment.T_map_sensor = scan.T_map_sensor;
  const std::shared_ptr<const Snapshot> published = map.snapshot.latest();
  const auto shared_at = [](const PoseSearch& search, const Eigen::Isometry3d& pose) {
    return sensing::NoiseModel::shared_variances(search.fitter().residuals(pose));
  };
  const auto search_from = [&](const Eigen::Isometry3d& start) {
    return PoseSearch(*published, surfaces_, scan, map.noise, limits, start, AlignmentReach(),
                      {.common_share = common_share}, &map);
  };
  if (!map.parameters.align) {
    result.shared = shared_at(search_from(scan.T_map_sensor), scan.T_map_sensor);
    return result;
  }
  ScanAlignment alignment(result, record.patches, scan, map.parameters);
  const PoseSearch search = search_from(alignment.expected());
  alignment.align(search, [&] { return contradicts(map, scan, alignment.expected(), limits); });
  const AlignmentOutcome outcome = result.alignment.outcome;
  const bool rejected = outcome == AlignmentOutcome::rejected;
  if (!rejected) result.shared = shared_at(search, result.alignment.T_map_sensor);
  if (rejected || outcome == AlignmentOutcome::unexplained)
    result.state.note_misfit(
        {result.alignment.T_map_sensor.translation(), farthest_reading(scan, limits.max_m), rejected});
  return result;
}

}  // namespace octosurf::alignment
