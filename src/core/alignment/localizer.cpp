// Finds the place of a scan, or of another map, in a complete map.
#include "alignment/contradiction.hpp"
#include "alignment/near_surfaces.hpp"
#include "alignment/pose_search.hpp"
#include "alignment/run_places.hpp"
#include "geometry/degrees.hpp"
#include "sensing/downsample.hpp"
#include "sensing/noise_model.hpp"
#include "sensing/reading_code.hpp"
#include "surfaces/map_state.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/map_alignment.hpp>

namespace octosurf {
namespace {

/// Throws Error(usage) for an empty map or an invalid reach.
void require_reach(const std::shared_ptr<const Snapshot>& map, const AlignmentReach& reach) {
  if (map == nullptr) throw Error(Error::Kind::usage, "map", "is null", "give the snapshot of a map");
  if (!(reach.translation_m > 0 && reach.translation_m <= alignment::most_reach_m))
    throw Error(Error::Kind::usage, "reach", "is " + std::to_string(reach.translation_m) + " m",
                "it must be above 0, and 10 m at most");
  if (!(reach.rotation_rad > 0 && deg_per_rad * reach.rotation_rad <= 180.0001))
    throw Error(Error::Kind::usage, "turn", "is " + std::to_string(deg_per_rad * reach.rotation_rad) + "°",
                "it must be above 0, and 180° at most");
}

/// Of a scan's samples, on known surfaces where it is found: of another room of the same size a tenth fits
/// somewhere. At right poses in maps of half a room 0.29 and more are known.
constexpr double least_known_share = 0.2;

/// The scan of `search`, of whose pose is known what it says.
Alignment locate_scan(const alignment::PoseSearch& search, const alignment::CheckedMap& map) {
  const Eigen::Isometry3d& given = search.scan().T_map_sensor;
  Alignment result;
  result.samples = search.samples();
  std::optional<alignment::PoseFit> found = search.coarse(given, map.octree);
  const alignment::PoseFit fit =
      found
          ? *found
          : search.fine(given, alignment::uncertainty(search.reach().rotation_rad, map.snapshot.resolution));
  const bool hardly_known =
      static_cast<double>(fit.known) < least_known_share * static_cast<double>(search.samples());
  if (found && (hardly_known || is_refuted(fit, search, map, result.contradicted))) found.reset();
  const alignment::Determined determined = alignment::determined_by(fit, map.snapshot.resolution);
  alignment::describe(fit, determined, search.reach(), result);
  // Of a pose that is turned far, nothing of the guess remains.
  const bool far = search.reach().rotation_rad > alignment::most_turn_rad;
  if (!found)
    result.T_map_sensor = given;
  else
    result.T_map_sensor = far ? fit.T_map_sensor : alignment::without_undetermined(given, fit, determined);
  result.outcome = found                                        ? AlignmentOutcome::corrected
                   : fit.known < alignment::least_known_samples ? AlignmentOutcome::nothing_known
                                                                : AlignmentOutcome::unexplained;
  return result;
}

/// A point on a surface, in the frame of its map.
struct Reading {
  Eigen::Vector3d point;
  Eigen::Vector3d sensor;  ///< approximate position
  double off = 0;          ///< distance from its surface's plane, m
};

/// Of the other map's points, those that may meet the map's surfaces within reach. Surface by surface, so
/// that neighbours in the list are mostly neighbours on one surface, as in a scan.
std::vector<Reading> readings_near(const Snapshot& map, const AlignmentReach& reach,
                                   const surfaces::MapState& other, const Eigen::Isometry3d& T_map_other) {
  Eigen::AlignedBox3d box;
  for (const SurfacePtr& surface : map.surfaces)
    for (const Eigen::Vector3d& vertex : surface->boundary) box.extend(vertex);
  const auto is_near = [&](const Eigen::Vector3d& p) {
    const double off = reach.translation_m + reach.rotation_rad * (p - box.center()).norm();
    return !box.isEmpty() && box.squaredExteriorDistance(p) <= off * off;
  };
  std::map<SurfaceId, std::vector<Reading>> of_surface;
  other.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) {
    const Eigen::Vector3d point = p.position.cast<double>();
    if (p.surface == 0 || !is_near(T_map_other * point)) return;
    const Plane& plane = other.surfaces.find(p.surface)->plane();
    const Eigen::Vector3d sensor = point + sensing::range_of_class(p.range_class) * p.view.cast<double>();
    of_surface[p.surface].push_back({point, sensor, plane.signed_distance(point)});
  });
  std::vector<Reading> all;
  for (const auto& [id, readings] : of_surface) all.insert(all.end(), readings.begin(), readings.end());
  return all;
}

/// Ratio of the deviation of neighbouring points from their planes to the sensor's noise: poses that drifted
/// during mapping cause common errors, unlike a scan's noise.
double noise_factor(const std::vector<Reading>& readings, const sensing::NoiseModel& noise) {
  double squares = 0, expected = 0;
  for (std::size_t i = 0; i + alignment::most_in_a_row <= readings.size(); i += alignment::most_in_a_row) {
    double off = 0;
    for (std::size_t k = i; k < i + alignment::most_in_a_row; ++k)
      off += readings[k].off / alignment::most_in_a_row;
    const auto range = static_cast<float>((readings[i].point - readings[i].sensor).norm());
    const double spread = noise.measured_sigma(sensing::range_class_of(range));
    squares += off * off;
    expected += spread * spread / alignment::most_in_a_row;
  }
  return expected > 0 ? std::max(1.0, std::sqrt(squares / expected)) : 1;
}

}  // namespace

struct Localizer::Impl {
  std::shared_ptr<const Snapshot> map;
  AlignmentReach reach;
  OccupancyView octree;
  alignment::NearSurfaces surfaces, surfaces_around;
  std::optional<alignment::CellPyramid> cells{};
};

Localizer::Localizer(std::shared_ptr<const Snapshot> map, const AlignmentReach& reach) {
  require_reach(map, reach);
  const OccupancyView octree = map->octree;
  impl_ = std::make_unique<Impl>(Impl{std::move(map), reach, octree, {}, {}});
}
Localizer::Localizer(const Map& map, const AlignmentReach& reach) : Localizer(map.snapshot(), reach) {
  impl_->octree = map.octree();
  impl_->reach.up = map.parameters().up.value_or(reach.up);
}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

Alignment Localizer::operator()(const Scan& scan) {
  require_rigid(scan.T_map_sensor, scan.name);
  sensing::NoiseModel noise{Parameters()};
  noise.observe(scan);
  const alignment::RangeLimits limits{0, sensing::default_max_range(scan.sensor)};
  const alignment::PoseSearch search(*impl_->map, impl_->surfaces, scan, noise, limits, scan.T_map_sensor,
                                     impl_->reach);
  return locate_scan(search, {*impl_->map, impl_->octree, impl_->surfaces_around});
}

Whereabouts Localizer::find(std::span<const Scan> scans, const Eigen::AlignedBox3d& region, bool upright) {
  if (!impl_->cells) impl_->cells.emplace(impl_->octree, alignment::PlaceLimits().cell_m);
  const alignment::RunPlaces places = places_of(scans, {*impl_->map, impl_->octree, impl_->surfaces_around},
                                                *impl_->cells, impl_->reach.up, region, upright);
  return judge(places, scans.back().T_map_sensor);
}

/// The points on the other map's surfaces are one scan from many places, as of a moving sensor.
MapAlignment align_maps(const std::shared_ptr<const Snapshot>& map, const Map& other,
                        const Eigen::Isometry3d& T_map_other, const AlignmentReach& reach) {
  require_rigid(T_map_other, "T_map_other");
  require_reach(map, reach);
  const surfaces::MapState& theirs = surfaces::state_of(other);
  const std::vector<Reading> readings = readings_near(*map, reach, theirs, T_map_other);
  Eigen::Isometry3d T_other_sensor = Eigen::Isometry3d::Identity();
  for (const Reading& reading : readings)
    T_other_sensor.translation() += reading.sensor / static_cast<double>(readings.size());
  Scan scan;
  scan.name = "the other map";
  scan.sensor = SensorKind::lidar;  // no range limit
  scan.T_map_sensor = T_map_other * T_other_sensor;
  for (const Reading& reading : readings) {
    scan.points.push_back((reading.point - T_other_sensor.translation()).cast<float>());
    scan.origins.push_back((reading.sensor - T_other_sensor.translation()).cast<float>());
  }
  MapAlignment result{T_map_other, {}};
  result.scan.outcome = AlignmentOutcome::nothing_known;
  result.scan.T_map_sensor = scan.T_map_sensor;
  if (readings.empty()) return result;
  alignment::FitErrors errors;
  errors.noise_factor = noise_factor(readings, theirs.noise);
  alignment::NearSurfaces surfaces, surfaces_around;
  const alignment::RangeLimits all{0, std::numeric_limits<double>::infinity()};
  const alignment::PoseSearch search(*map, surfaces, scan, theirs.noise, all, scan.T_map_sensor, reach,
                                     errors);
  result.scan = locate_scan(search, {*map, map->octree, surfaces_around});
  if (result.scan.outcome == AlignmentOutcome::corrected)
    result.T_map_other = result.scan.T_map_sensor * T_other_sensor.inverse();
  return result;
}

}  // namespace octosurf
