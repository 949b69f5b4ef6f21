#include "alignment/plane_match.hpp"

#include "alignment/pose_fit.hpp"
#include "geometry/moments.hpp"
#include "geometry/voxel_key.hpp"
#include "sensing/reading_code.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::alignment {
namespace {

constexpr double normal_spread = std::numbers::pi / 180;  // rad: error of a scan's plane of a few patches
constexpr double offset_spread = 0.01;                    // m
constexpr std::size_t most_planes = 12, most_surfaces = 10;
/// Triples whose normals span less volume determine a direction worse than a quarter as well as their planes.
constexpr double least_volume = 0.25;

constexpr std::size_t most_readings = 20000, most_found = 24;
constexpr double patch_edge = 8;      // voxels: with some twenty of a camera's readings
constexpr double least_readings = 6;  // of a patch: three for its plane, and as many to check it
constexpr double same_normal = 0.99;  // cosine: patches' normals are accurate to a few degrees
constexpr double same_plane = 2;      // voxels: distance from the plane

/// Toward the sensor.
Eigen::Vector3d normal_of(const geometry::PlaneFit& fit) {
  return fit.normal.dot(fit.centroid) > 0 ? Eigen::Vector3d(-fit.normal) : fit.normal;
}

}  // namespace

std::vector<ScanPatch> patches_of(const Scan& scan, const sensing::NoiseModel& noise,
                                  const RangeLimits& limits, double resolution) {
  const double edge = patch_edge * resolution;
  std::vector<ScanPatch> patches;
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> places;
  const std::size_t step = std::max<std::size_t>(1, scan.points.size() / most_readings);
  for (std::size_t i = 0; i < scan.points.size(); i += step) {
    const Eigen::Vector3d point = scan.points[i].cast<double>();
    const double range = point.norm();
    if (!limits.hold(range) || range > edge * (1 << 19)) continue;
    const auto [at, added] = places.try_emplace(
        geometry::packed_cell((point / edge).array().floor().cast<int>().matrix()), patches.size());
    if (added) patches.emplace_back().reading = point;
    ScanPatch& patch = patches[at->second];
    patch.moments.add(point);
    const double spread = noise.measured_sigma(sensing::range_class_of(static_cast<float>(range)));
    patch.variance += spread * spread;
  }
  return patches;
}

bool ScanPatch::fit_plane() {
  const geometry::PlaneFit fit = geometry::fit_plane(moments);
  centroid = fit.centroid;
  normal = normal_of(fit);
  const double noise = variance / moments.count;
  return moments.count >= least_readings && fit.variances[0] <= 2 * noise &&
         fit.variances[1] >= 4 * fit.variances[0];
}

namespace {

/// A plane that many readings of one scan lie on, sensor's frame.
struct ScanPlane {
  Eigen::Vector3d normal;    ///< unit, toward the sensor
  Eigen::Vector3d centroid;  ///< of its readings
  double readings = 0;       ///< patches' readings, a measure of the visible area
};

/// The largest planes of a scan, largest first: patches of neighbouring readings that are flat within noise,
/// joined where they are coplanar. Uses some ten thousand readings, independent of their order. O(readings).
std::vector<ScanPlane> planes_of_scan(const Scan& scan, const sensing::NoiseModel& noise,
                                      const RangeLimits& limits, double resolution) {
  std::vector<ScanPatch> patches = patches_of(scan, noise, limits, resolution);
  std::erase_if(patches, [](ScanPatch& patch) { return !patch.fit_plane(); });
  std::stable_sort(patches.begin(), patches.end(),
                   [](const ScanPatch& a, const ScanPatch& b) { return a.moments.count > b.moments.count; });
  std::vector<ScanPlane> planes;
  while (!patches.empty() && planes.size() < most_found) {
    geometry::Moments all = patches.front().moments;
    geometry::PlaneFit fit = geometry::fit_plane(all);
    // Twice: readings collected by the first patch's plane give a better plane, which collects the rest.
    for (int round = 0; round < 2; ++round) {
      all = {};
      for (ScanPatch& patch : patches) {
        patch.on_plane = &patch == &patches.front() ||
                         (std::fabs(patch.normal.dot(fit.normal)) > same_normal &&
                          std::fabs(fit.normal.dot(patch.centroid - fit.centroid)) < same_plane * resolution);
        if (patch.on_plane) all.add(patch.moments);
      }
      fit = geometry::fit_plane(all);
    }
    planes.push_back({normal_of(fit), fit.centroid, all.count});
    std::erase_if(patches, [](const ScanPatch& patch) { return patch.on_plane; });
  }
  std::stable_sort(planes.begin(), planes.end(),
                   [](const ScanPlane& a, const ScanPlane& b) { return a.readings > b.readings; });
  return planes;
}

struct Match {
  const ScanPlane* plane;
  const AlignedSurface* surface;
};

class Matcher {
 public:
  Matcher(const Eigen::Isometry3d& start, const AlignmentReach& reach) : start_(start), reach_(reach) {
    prior_.head<3>().setConstant(1 / (reach.rotation_rad * reach.rotation_rad));
    prior_.tail<3>().setConstant(1 / (reach.translation_m * reach.translation_m));
  }

  /// The surfaces that a plane may correspond to, nearest first.
  std::vector<Match> candidates(const ScanPlane& plane,
                                std::span<const AlignedSurface* const> surfaces) const {
    const Eigen::Vector3d normal = start_.linear() * plane.normal, centroid = start_ * plane.centroid;
    const double least_cosine = std::cos(reach_.rotation_rad + 3 * normal_spread);
    const double most_off = reach_.translation_m + reach_.rotation_rad * plane.centroid.norm();
    std::vector<std::pair<double, Match>> found;
    for (const AlignedSurface* surface : surfaces) {
      const double off = std::fabs(surface->plane.signed_distance(centroid));
      if (normal.dot(surface->plane.normal) < least_cosine || off > most_off) continue;
      if (!surface->raster.near((surface->T_surface_map * centroid).head<2>(), most_off)) continue;
      found.push_back({off, {&plane, surface}});
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Match> matches;
    for (std::size_t i = 0; i < std::min(most_surfaces, found.size()); ++i)
      matches.push_back(found[i].second);
    return matches;
  }

  /// Least-squares pose; false if it is out of reach.
  bool solve(std::span<const Match> matches, Eigen::Isometry3d& pose) const {
    TwistCovariance normal_matrix = prior_.asDiagonal();
    Twist right = Twist::Zero();
    for (const Match& match : matches) {
      const Eigen::Vector3d from = start_.linear() * match.plane->normal, &to = match.surface->plane.normal;
      const Eigen::Vector3d arm = start_.linear() * match.plane->centroid;
      Eigen::Matrix<double, 4, 6> rows = Eigen::Matrix<double, 4, 6>::Zero();
      Eigen::Vector4d values;
      // ω × from = to − from
      rows.topLeftCorner<3, 3>() << 0, from.z(), -from.y(), -from.z(), 0, from.x(), from.y(), -from.x(), 0;
      values.head<3>() = to - from;
      rows.topRows<3>() /= normal_spread;
      values.head<3>() /= normal_spread;
      rows.row(3) << arm.cross(to).transpose() / offset_spread, to.transpose() / offset_spread;
      values[3] = -match.surface->plane.signed_distance(start_.translation() + arm) / offset_spread;
      normal_matrix += rows.transpose() * rows;
      right += rows.transpose() * values;
    }
    const Twist twist = normal_matrix.ldlt().solve(right);
    constexpr double slack = 1.5;  // tolerance for planes of a few patches
    pose = moved(start_, twist);
    return twist.head<3>().norm() < slack * reach_.rotation_rad &&
           twist.tail<3>().norm() < slack * reach_.translation_m;
  }

 private:
  Eigen::Isometry3d start_;
  AlignmentReach reach_;
  Twist prior_;
};

using Triple = std::array<std::size_t, 3>;

/// Triples of planes with normals far from coplanar, sorted by the readings of the smallest, largest first.
/// Without any, as in a corridor or on a floor: pairs, then single planes, with a plane repeated.
std::vector<Triple> triples_of(std::span<const ScanPlane> planes) {
  std::vector<Triple> triples;
  for (const std::size_t different : {3U, 2U, 1U}) {
    for (std::size_t i = 0; i < planes.size(); ++i)
      for (std::size_t j = different > 1 ? i + 1 : i; j < (different > 1 ? planes.size() : i + 1); ++j)
        for (std::size_t k = different > 2 ? j + 1 : j; k < (different > 2 ? planes.size() : j + 1); ++k) {
          const Eigen::Vector3d across = planes[i].normal.cross(planes[j].normal);
          if (different == 3 && std::fabs(across.dot(planes[k].normal)) < least_volume) continue;
          if (different == 2 && across.norm() < least_volume) continue;
          triples.push_back({i, j, k});
        }
    if (!triples.empty()) break;
  }
  std::stable_sort(triples.begin(), triples.end(), [&](const Triple& a, const Triple& b) {
    return planes[a[2]].readings > planes[b[2]].readings;
  });
  return triples;
}

}  // namespace

std::vector<Eigen::Vector3d> directions_of(const Scan& scan, const sensing::NoiseModel& noise,
                                           const RangeLimits& limits, double resolution) {
  std::vector<Eigen::Vector3d> directions;
  for (const ScanPlane& plane : planes_of_scan(scan, noise, limits, resolution)) {
    const auto is_parallel = [&](const Eigen::Vector3d& other) {
      return std::fabs(other.dot(plane.normal)) > same_normal;
    };
    if (std::ranges::none_of(directions, is_parallel)) directions.push_back(plane.normal);
    if (directions.size() == 4) break;  // in rooms two of three walls are in view, and the floor
  }
  return directions;
}

std::vector<Eigen::Isometry3d> poses_by_planes(const Scan& scan, const sensing::NoiseModel& noise,
                                               const RangeLimits& limits, double resolution,
                                               std::span<const AlignedSurface* const> surfaces,
                                               const Eigen::Isometry3d& start, const AlignmentReach& reach,
                                               std::size_t most) {
  const Matcher matcher(start, reach);
  const std::vector<ScanPlane> planes = planes_of_scan(scan, noise, limits, resolution);
  std::vector<ScanPlane> known;
  std::vector<std::vector<Match>> candidates;
  for (const ScanPlane& plane : planes) {
    std::vector<Match> of_plane = matcher.candidates(plane, surfaces);
    if (of_plane.empty()) continue;
    known.push_back(plane);
    candidates.push_back(std::move(of_plane));
    if (known.size() == most_planes) break;
  }
  std::vector<Eigen::Isometry3d> poses;
  for (const auto& [i, j, k] : triples_of(known)) {
    for (const Match& a : candidates[i])
      for (const Match& b : candidates[j]) {
        if (j == i && b.surface != a.surface) continue;
        for (const Match& c : candidates[k]) {
          if (k == j && c.surface != b.surface) continue;
          Eigen::Isometry3d pose;
          if (matcher.solve(std::array{a, b, c}, pose)) poses.push_back(pose);
          if (poses.size() == most) return poses;
        }
      }
  }
  return poses;
}

}  // namespace octosurf::alignment
