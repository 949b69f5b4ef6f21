#include "alignment/scan_planes.hpp"

#include "geometry/moments.hpp"
#include "geometry/voxel_key.hpp"
#include "sensing/reading_code.hpp"

#include <algorithm>
#include <cmath>
#include <tsl/robin_map.h>

namespace octosurf::alignment {
namespace {

constexpr std::size_t most_readings = 20000, most_planes = 24;
constexpr double patch_edge = 8;      // voxels: with some twenty of a camera's readings
constexpr double least_readings = 6;  // of a patch: three for its plane, and as many to check it
constexpr double same_normal = 0.99;  // cosine: patches' normals are accurate to a few degrees
constexpr double same_plane = 2;      // voxels: distance from the plane

struct ScanPatch {
  geometry::Moments moments;  ///< about the sensor
  double variance = 0;        ///< Σ of the readings' along the line of sight
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(), centroid = Eigen::Vector3d::Zero();
};

std::uint64_t cell_of(const Eigen::Vector3d& point, double edge) {
  const auto part = [&](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / edge)) + (1 << 20));
  };
  return part(point.x()) << 42 | part(point.y()) << 21 | part(point.z());
}

/// In the order of the scan's first reading in each.
std::vector<ScanPatch> collect(const Scan& scan, const sensing::NoiseModel& noise, double min_range,
                               double max_range, double edge) {
  std::vector<ScanPatch> patches;
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> places;
  const std::size_t step = std::max<std::size_t>(1, scan.points.size() / most_readings);
  for (std::size_t i = 0; i < scan.points.size(); i += step) {
    const Eigen::Vector3d point = scan.points[i].cast<double>();
    const double range = point.norm();
    if (!(range >= min_range && range > 0 && range <= std::min(max_range, edge * (1 << 19)))) continue;
    const auto [at, added] = places.try_emplace(cell_of(point, edge), patches.size());
    if (added) patches.emplace_back();
    ScanPatch& patch = patches[at->second];
    patch.moments.add(point);
    const double spread = noise.measured_sigma(sensing::range_class_of(static_cast<float>(range)));
    patch.variance += spread * spread;
  }
  return patches;
}

/// Keeps the flat ones, with their planes; most readings first.
void keep_flat(std::vector<ScanPatch>& patches) {
  std::erase_if(patches, [](ScanPatch& patch) {
    if (patch.moments.count < least_readings) return true;
    const geometry::PlaneFit fit = geometry::fit_plane(patch.moments);
    patch.centroid = fit.centroid;
    patch.normal = fit.normal.dot(fit.centroid) > 0 ? Eigen::Vector3d(-fit.normal) : fit.normal;
    const double noise = patch.variance / patch.moments.count;
    return fit.variances[0] > 2 * noise || fit.variances[1] < 4 * fit.variances[0];
  });
  std::stable_sort(patches.begin(), patches.end(),
                   [](const ScanPatch& a, const ScanPatch& b) { return a.moments.count > b.moments.count; });
}

}  // namespace

std::vector<ScanPlane> planes_of_scan(const Scan& scan, const sensing::NoiseModel& noise, double min_range,
                                      double max_range, double resolution) {
  std::vector<ScanPatch> patches = collect(scan, noise, min_range, max_range, patch_edge * resolution);
  keep_flat(patches);
  std::vector<ScanPlane> planes;
  while (!patches.empty() && planes.size() < most_planes) {
    geometry::Moments all = patches.front().moments;
    geometry::PlaneFit fit = geometry::fit_plane(all);
    // Twice: readings collected by the first patch's plane give a better plane, which collects the rest.
    std::vector<char> on_it;
    for (int round = 0; round < 2; ++round) {
      all = {};
      on_it.assign(patches.size(), 0);
      for (std::size_t i = 0; i < patches.size(); ++i) {
        const bool same =
            std::fabs(patches[i].normal.dot(fit.normal)) > same_normal &&
            std::fabs(fit.normal.dot(patches[i].centroid - fit.centroid)) < same_plane * resolution;
        if (!same && i > 0) continue;
        on_it[i] = 1;
        all.add(patches[i].moments);
      }
      fit = geometry::fit_plane(all);
    }
    const Eigen::Vector3d normal =
        fit.normal.dot(fit.centroid) > 0 ? Eigen::Vector3d(-fit.normal) : fit.normal;
    planes.push_back({normal, fit.centroid, all.count});
    std::size_t kept = 0;
    for (std::size_t i = 0; i < patches.size(); ++i)
      if (on_it[i] == 0) patches[kept++] = patches[i];
    patches.resize(kept);
  }
  std::stable_sort(planes.begin(), planes.end(),
                   [](const ScanPlane& a, const ScanPlane& b) { return a.readings > b.readings; });
  return planes;
}

}  // namespace octosurf::alignment
