#include "alignment/run_places.hpp"

#include "alignment/plane_match.hpp"
#include "sensing/downsample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

namespace octosurf::alignment {
namespace {

/// Angle of the directions about `up` in which samples are explained at a pose, in twelfths of the circle.
double seen_rad(const PoseSearch& search, const Eigen::Isometry3d& pose) {
  constexpr std::size_t parts = 12;
  std::array<std::size_t, parts> explained{};
  const Eigen::Vector3d& up = search.reach().up;
  const Eigen::Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  const auto verdicts = search.fitter().judge(pose, search.reach().translation_m);
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i] != PoseFitter::Verdict::explained) continue;
    const Eigen::Vector3d sight = pose.linear() * search.all_samples()[i].point;
    const double share = std::atan2(sight.dot(y), sight.dot(x)) / (2 * std::numbers::pi) + 0.5;
    ++explained[static_cast<std::size_t>(share * parts) % parts];
  }
  // A hundredth: a direction has eight of them.
  const auto seen =
      std::ranges::count_if(explained, [&](std::size_t count) { return 100 * count >= search.samples(); });
  return 2 * std::numbers::pi / parts * static_cast<double>(seen);
}

/// m, by which the poses of a run are off against each other: odometry's 1 % of the way, of which a half to
/// its middle, and of that half on the average. Turns count as in revisit_span_m.
double drift_of(std::span<const Scan> scans) {
  double way = 0;
  for (std::size_t i = 1; i < scans.size(); ++i) {
    const Twist step = twist_between(scans[i - 1].T_map_sensor, scans[i].T_map_sensor);
    way += step.head<3>().norm() + step.tail<3>().norm();
  }
  return 0.01 * way / 4;
}

/// Turns of the scans' frame by which it gets the map's up: none if it has that; else by each plane in turn.
std::vector<Eigen::Matrix3d> tilts_of(const Scan& run, const sensing::NoiseModel& noise,
                                      const RangeLimits& range, double resolution, const Eigen::Vector3d& up,
                                      bool upright) {
  if (upright) return {Eigen::Matrix3d::Identity()};
  std::vector<Eigen::Matrix3d> tilts;
  for (const Eigen::Vector3d& normal : directions_of(run, noise, range, resolution))
    for (const double side : {1.0, -1.0})
      tilts.emplace_back(Eigen::Quaterniond::FromTwoVectors(run.T_map_sensor.linear() * normal, side * up));
  return tilts;
}

}  // namespace

RunPlaces places_of(std::span<const Scan> scans, const CheckedMap& map, const CellPyramid& cells,
                    const Eigen::Vector3d& up, const Eigen::AlignedBox3d& region, bool upright,
                    const PlaceLimits& limits) {
  const Scan run = joined(scans);
  sensing::NoiseModel noise{Parameters()};
  noise.observe(scans.front());
  noise.observe(scans.back());
  const RangeLimits range{0, sensing::default_max_range(run.sensor)};
  const double resolution = map.snapshot.resolution;
  const Places candidates =
      search_places(cells, run, noise, range, resolution, up,
                    tilts_of(run, noise, range, resolution, up, upright), region, limits);
  AlignmentReach reach;
  reach.up = up;
  FitErrors errors;
  errors.common_m += drift_of(scans);
  RunPlaces places{{}, candidates.complete && !run.points.empty(), candidates.poses.size()};
  for (const Eigen::Isometry3d& pose : candidates.poses) {
    const PoseSearch search(map.snapshot, map.surfaces, run, noise, range, pose, reach, errors);
    const std::optional<PoseFit> fit = search.coarse(pose, map.octree);
    if (!fit) continue;
    const Determined determined = determined_by(*fit, resolution);
    PlacedRun placed;
    describe(*fit, determined, reach, placed.alignment);
    placed.alignment.outcome = AlignmentOutcome::corrected;
    placed.alignment.T_map_sensor = fit->T_map_sensor;
    placed.alignment.samples = search.samples();
    placed.alignment.contradicted = contradiction_at(fit->T_map_sensor, search, map.octree).all();
    placed.sigma_m = std::sqrt(determined.variances.maxCoeff());
    placed.seen_rad = seen_rad(search, fit->T_map_sensor);
    places.placed.push_back(placed);
  }
  std::ranges::stable_sort(places.placed, std::greater(), &PlacedRun::value);
  return places;
}

Whereabouts judge(const RunPlaces& places, const Eigen::Isometry3d& T_scans_sensor, const PlaceLimits& limits,
                  const PlaceAcceptance& acceptance) {
  Whereabouts result;
  const auto fits = [&](const PlacedRun& placed) {
    const Alignment& a = placed.alignment;
    return a.contradicted <= acceptance.contradicted &&
           static_cast<double>(a.known) >= acceptance.known * static_cast<double>(a.samples);
  };
  const auto best = std::ranges::find_if(places.placed, fits);
  if (best == places.placed.end()) {
    // Clutter may look like it and be no surface to fit; what explains most of it may have had things moved.
    const bool none = places.candidates == 0 ||
                      (!places.placed.empty() && places.placed.front().seen_rad > std::numbers::pi &&
                       places.placed.front().value() < 0.5);
    if (places.complete && none) result.finding = Finding::not_here;
    return result;
  }
  result.places.push_back(best->alignment);
  result.seen_rad = best->seen_rad;
  result.margin = best->value();
  for (const PlacedRun& placed : places.placed) {
    const Twist off = twist_between(best->alignment.T_map_sensor, placed.alignment.T_map_sensor);
    if (off.tail<3>().norm() <= limits.apart_m && off.head<3>().norm() <= limits.apart_rad) continue;
    const double margin = best->value() - placed.value();
    result.margin = std::min(result.margin, margin);
    if (margin < acceptance.margin + best->alignment.contradicted) result.places.push_back(placed.alignment);
  }
  const double beyond_half = best->seen_rad / std::numbers::pi - 1;
  if (result.places.size() > 1) {
    result.finding = Finding::several_places;
  } else if (places.complete && best->sigma_m < acceptance.sigma_m &&
             best->alignment.explained_share() >= acceptance.explained &&
             best->contradicted_share() < acceptance.contradicted_all_around * beyond_half) {
    result.finding = Finding::found;
    result.T_map_scans = best->alignment.T_map_sensor * T_scans_sensor.inverse();
  }
  return result;
}

}  // namespace octosurf::alignment
