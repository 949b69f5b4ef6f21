#include "alignment/scan_aligner.hpp"

#include "alignment/contradiction.hpp"
#include "alignment/drift_filter.hpp"
#include "alignment/revisit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <memory>
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

/// A session may begin in another frame: after a break its first scans are checked, whether or not they fit.
/// Nothing that walks moves a metre, or turns by a radian, between scans of one session; of scans farther
/// apart each is checked, which costs 3 ms. (Not by time: the same scans by another clock make the same map.)
constexpr double break_m = 1, break_rad = 1;
/// Scans inserted after a break until the frame counts as the map's. Insertions are counted, not tries: in
/// another frame each view contradicts, while among people who stand in the way some do not.
constexpr std::size_t settling_scans = 10;

bool is_break(const AlignmentState& state, const Eigen::Isometry3d& given) {
  if (!state.last) return false;
  const Eigen::Isometry3d moved = state.last->inverse() * given;
  return moved.translation().norm() > break_m || Eigen::AngleAxisd(moved.linear()).angle() > break_rad;
}

/// A quarter of a scan contradicts the map, in both ways: what came stands in free space, what went is seen
/// through, but a wrong pose does both. Half of what a wrong pose puts on floor and ceiling agrees, walls do
/// not.
bool contradicts(const OccupancyView& octree, const PoseSearch& search,
                 const Eigen::Isometry3d& T_map_sensor) {
  constexpr double each_way = 0.1, both_ways = 0.25;
  const Contradiction found = contradiction_at(T_map_sensor, search, octree);
  return found.in_free_space >= each_way && found.behind >= each_way && found.all() > both_ways;
}

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
    if (is_break(state_, given_)) state_.unsettled = settling_scans;
    drift_.advance(given_);
    expected_ = drift_.pose();
  }

  void align(const PoseSearch& search, const CheckedMap& map);
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
    const Revisit revisit =
        measure(observed, state_.travelled_m, drift_.sensor_errors(), state_.patch_m, resolution_);
    describe(revisit, result_.alignment);
    if (revisit.patches > 0) {
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

void ScanAlignment::align(const PoseSearch& search, const CheckedMap& map) {
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
    const std::optional<PoseFit> found =
        fits && !strange ? std::nullopt : search.coarse(expected_, map.octree);
    if (found) {
      const Determined determined = determined_by(*found, resolution_);
      alignment.known = found->known;
      alignment.explained = found->explained;
      if (found_elsewhere(search, *found, determined)) {
        describe(*found, determined, search.reach(), alignment);
        alignment.outcome = AlignmentOutcome::rejected;
        if (!is_refuted(*found, search, map, alignment.contradicted)) note_jump(*found, determined);
        return;
      }
      fits = true;
    }
    if (!fits || strange) state_.failed_search = here;
  }
  fits = fits && known;
  if ((state_.unsettled > 0 || !fits) && contradicts(map.octree, search, expected_)) {
    alignment.outcome = AlignmentOutcome::rejected;
    return;
  }
  if (state_.unsettled > 0 && fits) --state_.unsettled;
  follow(layout);
  if (known) learn();
  if (known && !fits)
    alignment.outcome = AlignmentOutcome::unexplained;
  else if (!known && !drift_.drifts())
    alignment.outcome = AlignmentOutcome::nothing_known;
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
  const OccupancyView octree = map.occupancy.now();
  alignment.align(search, {*published, octree, surfaces_around_, &map});
  if (result.alignment.outcome == AlignmentOutcome::rejected) return result;
  result.shared = shared_at(search, result.alignment.T_map_sensor);
  return result;
}

}  // namespace octosurf::alignment
