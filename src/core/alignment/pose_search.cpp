#include "alignment/pose_search.hpp"

#include "alignment/contradiction.hpp"
#include "alignment/plane_match.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace octosurf::alignment {
namespace {

constexpr std::size_t sample_count = 3000;
/// A few samples eliminate most poses, more of them rank the others.
constexpr std::size_t few = 50, more = 10;  // every so many samples
constexpr std::size_t most_poses = 4000, most_scored = 150, most_made_fine = 8;
/// Share of the known samples that a pose must explain: objects and people that moved seldom cover more of a
/// picture than the rest.
constexpr double least_explained = 0.7;
/// Voxels: readings with larger errors, by their residuals, would only deform the map.
constexpr double least_exact = 0.5;
/// Voxels: readings on a surface deviate by no more than their noise and a voxel.
constexpr double gate_voxels = 3;

Eigen::AlignedBox3d reachable_box(std::span<const Sample> samples, const Eigen::Isometry3d& T, double margin,
                                  double turn_rad) {
  Eigen::AlignedBox3d box;
  double farthest = 0;
  for (const Sample& sample : samples) {
    box.extend(T * sample.point);
    farthest = std::max(farthest, sample.point.norm());
  }
  if (box.isEmpty()) return box;
  box.min().array() -= margin + turn_rad * farthest;
  box.max().array() += margin + turn_rad * farthest;
  return box;
}

FitErrors with_gate(FitErrors errors, double gate_m) {
  errors.gate_m = gate_m;
  return errors;
}

double range_of(std::span<const Sample> samples) {
  double squares = 0;
  for (const Sample& sample : samples) squares += sample.point.squaredNorm();
  return samples.empty() ? 0 : std::sqrt(squares / static_cast<double>(samples.size()));
}

/// A twist along the directions, m.
Twist along(const Determined& determined, const Twist& twist) {
  return determined.directions.transpose() * determined.scale.cwiseInverse().asDiagonal() * twist;
}
/// Likewise; 0 along those that are not determined.
Twist determined_part(const Determined& determined, const Twist& twist) {
  Twist part = along(determined, twist);
  part.tail(6 - determined.count).setZero();
  return part;
}

}  // namespace

TwistCovariance uncertainty(double rotation, double translation) {
  Twist squares;
  squares << Eigen::Vector3d::Constant(rotation * rotation),
      Eigen::Vector3d::Constant(translation * translation);
  return squares.asDiagonal();
}

bool is_explained(const PoseFit& fit) {
  return fit.known >= least_known_samples && fit.explained_share() >= least_explained;
}

bool explains_as_well(const PoseFit& fit, const PoseFit& best) {
  const auto unexplained = static_cast<double>(best.known - best.explained);
  return static_cast<double>(fit.explained) >=
         static_cast<double>(best.explained) - by_chance * std::sqrt(unexplained + 1);
}

Determined determined_by(const PoseFit& fit, double resolution) {
  Determined determined;
  determined.scale << Eigen::Vector3d::Constant(1 / fit.lever_m), Eigen::Vector3d::Ones();
  const TwistCovariance in_metres =
      determined.scale.asDiagonal() * fit.information * determined.scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<TwistCovariance> axes(in_metres);  // ascending
  determined.directions = axes.eigenvectors().rowwise().reverse();
  const Twist information = axes.eigenvalues().reverse().cwiseMax(1e-12);
  determined.variances = information.cwiseInverse();
  const double tolerance = resolution / 2;  // larger errors would be visible in the octree
  determined.count = static_cast<int>((determined.variances.array() < tolerance * tolerance).count());
  return determined;
}

double length(const Determined& determined, const Twist& twist) {
  return determined_part(determined, twist).norm();
}

double deviations(const Determined& determined, const Twist& twist) {
  return determined_part(determined, twist).cwiseQuotient(determined.variances.cwiseSqrt()).norm();
}

Eigen::Isometry3d without_undetermined(const Eigen::Isometry3d& start, const PoseFit& fit,
                                       const Determined& determined) {
  Twist rest = along(determined, twist_between(start, fit.T_map_sensor));
  rest.head(determined.count).setZero();
  return moved(fit.T_map_sensor, -(determined.scale.asDiagonal() * determined.directions * rest));
}

void describe(const PoseFit& fit, const Determined& determined, const AlignmentReach& reach,
              Alignment& alignment) {
  set_directions(determined.directions, determined.variances.head(determined.count), fit.lever_m, reach,
                 alignment);
  alignment.known = fit.known;
  alignment.explained = fit.explained;
}

PoseSearch::PoseSearch(const Snapshot& map, NearSurfaces& surfaces, const Scan& scan,
                       const sensing::NoiseModel& noise, const RangeLimits& limits,
                       const Eigen::Isometry3d& start, const AlignmentReach& reach, const FitErrors& errors,
                       const surfaces::MapState* growing)
    : scan_(scan),
      noise_(noise),
      limits_(limits),
      resolution_(map.resolution),
      reach_(reach),
      turn_rad_(std::min(reach.rotation_rad, most_turn_rad)),
      samples_(
          sample_scan(scan, noise, limits, sample_count, least_exact * map.resolution / errors.noise_factor)),
      near_(surfaces.in(map,
                        reachable_box(samples_, start, gate_voxels * map.resolution + reach.translation_m,
                                      std::min(reach.rotation_rad, 2.0)),
                        growing)),
      fitter_(samples_, near_, with_gate(errors, gate_voxels * map.resolution)) {}

PoseFit PoseSearch::fine(const Eigen::Isometry3d& start, const TwistCovariance& prior) const {
  const double range = std::max(1.0, range_of(samples_));
  return fitter_.fit(start, prior + uncertainty(resolution_ / 2 / range, resolution_ / 2));
}

double PoseSearch::farthest_off() const {
  return reach_.translation_m + turn_rad_ * range_of(samples_) + gate_voxels * resolution_;
}

/// Keeps the poses with the best agreement, best first.
void PoseSearch::keep_best(std::vector<Eigen::Isometry3d>& poses, const Eigen::Isometry3d& start,
                           std::size_t every, std::size_t count) const {
  const std::vector<PoseFitter::Pairing> pairings = fitter_.pair(start, farthest_off(), every);
  std::vector<std::pair<double, std::size_t>> ranked;
  for (std::size_t i = 0; i < poses.size(); ++i)
    ranked.push_back({-fitter_.agreement(poses[i], pairings), i});
  std::sort(ranked.begin(), ranked.end());
  ranked.resize(std::min(count, ranked.size()));
  std::vector<Eigen::Isometry3d> kept;
  for (const auto& [score, i] : ranked) kept.push_back(poses[i]);
  poses = std::move(kept);
}

/// Samples with the same result at both poses are ignored (McNemar 1947).
bool PoseSearch::speak_for(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other,
                           double deviations) const {
  using Verdict = PoseFitter::Verdict;
  const std::vector<Verdict> at_one = fitter_.judge(one, farthest_off()),
                             at_other = fitter_.judge(other, farthest_off());
  double lead = 0, differ = 0;
  for (std::size_t i = 0; i < at_one.size(); ++i) {
    if (at_one[i] == Verdict::none || at_other[i] == Verdict::none || at_one[i] == at_other[i]) continue;
    lead += at_one[i] == Verdict::explained ? 1 : -1;
    differ += 1;
  }
  return lead > deviations * std::sqrt(differ);
}

/// Planes are matched by small turns. Larger ones, about the vertical, begin at several poses.
std::vector<Eigen::Isometry3d> PoseSearch::starts_around(const Eigen::Isometry3d& start) const {
  const double rest = reach_.rotation_rad - turn_rad_;
  const int aside = static_cast<int>(std::ceil(rest / (2 * turn_rad_)));
  std::vector<Eigen::Isometry3d> starts;
  for (int i = -aside; i <= aside; ++i) {
    Twist turn = Twist::Zero();
    if (aside > 0) turn.head<3>() = rest * i / aside * reach_.up;
    starts.push_back(moved(start, turn));
  }
  return starts;
}

std::vector<PoseFit> PoseSearch::candidates(const Eigen::Isometry3d& start) const {
  std::vector<PoseFit> fits;
  for (const Eigen::Isometry3d& from : starts_around(start)) add_candidates(from, fits);
  return fits;
}

void PoseSearch::add_candidates(const Eigen::Isometry3d& start, std::vector<PoseFit>& fits) const {
  std::vector<Eigen::Isometry3d> poses =
      poses_by_planes(scan_, noise_, limits_, resolution_, near_, start,
                      {reach_.translation_m, turn_rad_, reach_.up}, most_poses);
  poses.insert(poses.begin(), start);
  const double range = range_of(samples_);
  keep_best(poses, start, few, most_scored);
  keep_best(poses, start, more, most_scored);

  const auto apart = [&](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double by) {
    const Twist twist = twist_between(a, b);
    return std::max(twist.tail<3>().norm(), range * twist.head<3>().norm()) > by;
  };
  std::vector<Eigen::Isometry3d> starts;
  for (const Eigen::Isometry3d& pose : poses) {
    if (std::none_of(starts.begin(), starts.end(),
                     [&](const auto& other) { return !apart(pose, other, 2 * resolution_); }))
      starts.push_back(pose);
    if (starts.size() == most_made_fine) break;
  }
  for (const Eigen::Isometry3d& at : starts)
    fits.push_back(fine(at, uncertainty(resolution_ / range, resolution_)));
}

std::optional<PoseFit> PoseSearch::coarse(const Eigen::Isometry3d& start, const OccupancyView& octree) const {
  const std::vector<PoseFit> fits = candidates(start);
  const auto best = std::max_element(
      fits.begin(), fits.end(), [](const PoseFit& a, const PoseFit& b) { return a.explained < b.explained; });
  if (best == fits.end() || !is_explained(*best)) return {};
  // A pose counts as another one if it differs along determined directions.
  const Determined determined = determined_by(*best, resolution_);
  if (determined.count == 0) return {};
  std::vector<const PoseFit*> alike{&*best};
  for (const PoseFit& fit : fits) {
    const double differs = length(determined, twist_between(best->T_map_sensor, fit.T_map_sensor));
    if (differs > 2 * resolution_ && explains_as_well(fit, *best)) alike.push_back(&fit);
  }
  return least_contradicted(alike, octree);
}

/// None if another one contradicts about as little.
std::optional<PoseFit> PoseSearch::least_contradicted(const std::vector<const PoseFit*>& fits,
                                                      const OccupancyView& octree) const {
  if (fits.size() == 1) return *fits.front();
  std::vector<std::pair<Contradiction, const PoseFit*>> found;
  for (const PoseFit* fit : fits) found.emplace_back(contradiction_at(fit->T_map_sensor, *this, octree), fit);
  const auto least = std::min_element(
      found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first.all() < b.first.all(); });
  const Determined determined = determined_by(*least->second, resolution_);
  const auto same_place = [&](const PoseFit& fit) {
    return length(determined, twist_between(least->second->T_map_sensor, fit.T_map_sensor)) <=
           2 * resolution_;
  };
  for (const auto& [contradiction, fit] : found)
    if (!same_place(*fit) && !least->first.is_less_than(contradiction)) return {};
  return *least->second;
}

}  // namespace octosurf::alignment
